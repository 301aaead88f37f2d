//! What needs `alloc` but not `std`: `ct-lti`, and the estimator whose size is known at run time. The allocator hands out
//! a fixed piece of memory and takes nothing back, as a small device might; it also counts.

use core::alloc::{GlobalAlloc, Layout};
use core::sync::atomic::{AtomicUsize, Ordering};

use ct_lti::{Hold, StateVariableFilter, TransferFunction};
use ct_rls::{DynamicRls, RecursiveEstimator, Weights};
use nalgebra::{DMatrix, DVector};

use crate::Failure;

const SIZE: usize = 1 << 16;

#[repr(align(16))]
struct Memory(core::cell::UnsafeCell<[u8; SIZE]>);

// SAFETY: every byte is handed out once, by the atomic below.
unsafe impl Sync for Memory {}

static MEMORY: Memory = Memory(core::cell::UnsafeCell::new([0; SIZE]));
static USED: AtomicUsize = AtomicUsize::new(0);

struct Bump;

// SAFETY: the pieces do not overlap, lie within `MEMORY`, and are aligned: its start is, to 16 bytes, and more is refused.
unsafe impl GlobalAlloc for Bump {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let size = layout.size().next_multiple_of(16);
        let from = USED.fetch_add(size, Ordering::Relaxed);
        if layout.align() > 16 || from + size > SIZE {
            return core::ptr::null_mut();
        }
        // SAFETY: `from` lies within `MEMORY`.
        unsafe { MEMORY.0.get().cast::<u8>().add(from) }
    }

    unsafe fn dealloc(&self, _: *mut u8, _: Layout) {}
}

#[global_allocator]
static ALLOCATOR: Bump = Bump;

/// A first-order process `tau y' + y = K u` from its step response, by state variable filters and least squares.
pub fn check() -> Result<(), Failure> {
    let (gain, tau, dt) = (6.0, 110.0, 1.0);
    let plant =
        TransferFunction::from_coefficients(&[gain], &[1.0, tau]).map_err(|_| Failure::Settings)?;
    if !plant.exceeds(-1e-9).is_ok_and(|found| found.is_strict()) {
        return Err(Failure::Positivity);
    }
    let filter = |hold| StateVariableFilter::with_bandwidth(1, 4.0 / tau, hold);
    let mut filter_u = filter(Hold::Zero).map_err(|_| Failure::Settings)?;
    let mut filter_y = filter(Hold::First).map_err(|_| Failure::Settings)?;
    let mut plant = ct_lti::Simulator::new(
        ct_lti::StateSpace::controllable(&plant).map_err(|_| Failure::Settings)?,
        Hold::Zero,
    );
    let weights = Weights::least_squares(1e-4).map_err(|_| Failure::Settings)?;
    let p0 = DMatrix::identity(2, 2) * 1e6;
    let mut rls =
        DynamicRls::new(DVector::zeros(2), &p0, weights).map_err(|_| Failure::Settings)?;
    let mut used = 0;
    for k in 0..2000 {
        let u = if (k / 90 + k / 250) % 2 == 0 {
            1.0
        } else {
            -1.0
        };
        let y = plant.update(u, dt).map_err(|_| Failure::Filter)?;
        let u = filter_u.update(u, dt).map_err(|_| Failure::Filter)?;
        let y = filter_y.update(y, dt).map_err(|_| Failure::Filter)?;
        rls.update_with(&[-y[1], u[0]], y[0], dt, &weights);
        if k == 0 {
            used = USED.load(Ordering::Relaxed);
        }
    }
    if USED.load(Ordering::Relaxed) != used {
        return Err(Failure::Allocates);
    }
    let off = rls.theta() - DVector::from_column_slice(&[tau, gain]);
    if off[0].abs() > 0.05 || off[1].abs() > 0.005 {
        return Err(Failure::RunTimeSize);
    }
    Ok(())
}
