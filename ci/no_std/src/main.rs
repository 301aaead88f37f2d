//! Runs the estimators without std, without an allocator and without libc, and ends with 0 where they are right.
//! With the feature `heap` also what needs an allocator, on one of the program's own.
//!
//! Linux on x86-64 or aarch64. `bash ci/no_std/run` builds and runs it.
#![no_std]
#![no_main]

#[cfg(feature = "heap")]
mod heap;

use core::arch::asm;

use ct_constrained::{ConstrainedRls, Row, project_box};
use ct_rls::{ContinuousRls, RecursiveEstimator, Sample, Weights};
use nalgebra::{SMatrix, SVector};
use stabilized_oe::{BlockDiagonal, IoSample, LateDifference, StabilizedOe};

/// What ended the program, as its exit code.
enum Failure {
    Settings = 1,
    Theta = 2,
    Health = 3,
    Constraint = 4,
    Projection = 5,
    #[cfg(feature = "heap")]
    Filter = 6,
    #[cfg(feature = "heap")]
    Positivity = 7,
    #[cfg(feature = "heap")]
    RunTimeSize = 8,
    #[cfg(feature = "heap")]
    Allocates = 9,
    OutputError = 10,
    Panic = 101,
}

fn check() -> Result<(), Failure> {
    let weights = Weights::new(1.0, 0.9, 0.02).map_err(|_| Failure::Settings)?;
    let p0 = SMatrix::<f64, 2, 2>::identity() * 1e3;
    let mut rls =
        ContinuousRls::new(SVector::zeros(), p0, weights).map_err(|_| Failure::Settings)?;
    for k in 0..1000 {
        let u = if k % 60 < 30 { 1.0 } else { -1.0 };
        rls.update(&Sample::new([u, 1.0], 2.0 * u + 0.5), 0.5);
    }
    if (rls.theta() - SVector::from([2.0, 0.5])).amax() > 1e-6 {
        return Err(Failure::Theta);
    }
    let health = rls.health().map_err(|_| Failure::Health)?;
    if health.smallest_pivot <= 0.0 || health.excitation < 1.0 {
        return Err(Failure::Health);
    }

    let weights = Weights::least_squares(0.02).map_err(|_| Failure::Settings)?;
    let rls = ContinuousRls::new(SVector::zeros(), p0, weights).map_err(|_| Failure::Settings)?;
    let rows = [
        Row::equal([1.0, -1.0], 1.5, 1e3).map_err(|_| Failure::Settings)?,
        Row::at_least([0.0, 1.0], 0.0, 1e3).map_err(|_| Failure::Settings)?,
    ];
    let mut constrained = ConstrainedRls::new(rls, rows).map_err(|_| Failure::Settings)?;
    for _ in 0..1000 {
        // one direction only: the rest is known from the first row
        constrained.update(&Sample::new([1.0, 1.0], 2.5), 0.5);
    }
    if (constrained.theta() - SVector::from([2.0, 0.5])).amax() > 1e-6 {
        return Err(Failure::Constraint);
    }
    let (lower, upper) = (SVector::from([0.0, 0.0]), SVector::from([1.0, 1.0]));
    project_box(constrained.rls_mut(), &lower, &upper).map_err(|_| Failure::Projection)?;
    if (constrained.theta()[0] - 1.0).abs() > 1e-9 {
        return Err(Failure::Projection);
    }
    output_error()?;
    #[cfg(feature = "heap")]
    heap::check()?;
    Ok(())
}

/// A lag of 10 s and a gain of 2, from 5 s and 1.
fn output_error() -> Result<(), Failure> {
    let weights = Weights::least_squares(0.01).map_err(|_| Failure::Settings)?;
    let theta = ContinuousRls::with_integrator(
        SVector::from([5.0, 1.0]),
        SMatrix::from_diagonal(&SVector::from([10.0, 1.0])),
        weights,
    );
    let filter = ContinuousRls::with_integrator(
        SVector::from([10.0]),
        SMatrix::identity(),
        Weights::least_squares(0.0).map_err(|_| Failure::Settings)?,
    );
    let gain = BlockDiagonal::<1, 2>::new(
        theta.map_err(|_| Failure::Settings)?,
        filter.map_err(|_| Failure::Settings)?,
    );
    let mut estimator =
        StabilizedOe::new(gain, LateDifference::<3>::new()).map_err(|_| Failure::Settings)?;
    // 1 - e^(-dt/10)
    let (dt, share, mut y) = (0.5, 0.048_770_575_499_285_99, 0.0);
    for k in 0..4000 {
        let u = if k % 120 < 60 { 1.0 } else { -1.0 };
        estimator.update(&IoSample { u, y }, dt);
        y += share * (2.0 * u - y);
    }
    let theta = estimator.theta();
    if (theta[0] - 10.0).abs() > 0.1 || (theta[1] - 2.0).abs() > 0.02 {
        return Err(Failure::OutputError);
    }
    Ok(())
}

fn exit(code: i32) -> ! {
    // SAFETY: the system call `exit` does not return and touches no memory of this program.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        asm!("syscall", in("rax") 60, in("rdi") code, options(noreturn))
    }
    // SAFETY: as above.
    #[cfg(target_arch = "aarch64")]
    unsafe {
        asm!("svc 0", in("x8") 93, in("x0") code, options(noreturn))
    }
}

extern "C" fn begin() -> ! {
    exit(match check() {
        Ok(()) => 0,
        Err(failure) => failure as i32,
    })
}

// SAFETY: the loader jumps here with an aligned stack and no return address; a call aligns it as `begin` expects.
#[cfg(target_arch = "x86_64")]
core::arch::global_asm!(".globl _start", "_start:", "and rsp, -16", "call {begin}", begin = sym begin);
#[cfg(target_arch = "aarch64")]
core::arch::global_asm!(".globl _start", "_start:", "bl {begin}", begin = sym begin);

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    exit(Failure::Panic as i32)
}

/// What the compiler calls for copies; there is no libc. Volatile, or the loops would be turned into calls of themselves.
mod memory {
    use core::ptr::{read_volatile, write_volatile};

    /// # Safety
    /// As of C's `memcpy`.
    #[unsafe(no_mangle)]
    unsafe extern "C" fn memcpy(to: *mut u8, from: *const u8, n: usize) -> *mut u8 {
        for i in 0..n {
            // SAFETY: the caller vouches for `n` bytes on both sides.
            unsafe { write_volatile(to.add(i), read_volatile(from.add(i))) }
        }
        to
    }

    /// # Safety
    /// As of C's `memmove`.
    #[unsafe(no_mangle)]
    unsafe extern "C" fn memmove(to: *mut u8, from: *const u8, n: usize) -> *mut u8 {
        if to.cast_const() < from {
            // SAFETY: as the caller vouches; forwards does not overwrite what is still to be read.
            return unsafe { memcpy(to, from, n) };
        }
        for i in (0..n).rev() {
            // SAFETY: the caller vouches for `n` bytes on both sides.
            unsafe { write_volatile(to.add(i), read_volatile(from.add(i))) }
        }
        to
    }

    /// # Safety
    /// As of C's `memset`.
    #[unsafe(no_mangle)]
    unsafe extern "C" fn memset(to: *mut u8, value: i32, n: usize) -> *mut u8 {
        for i in 0..n {
            // SAFETY: the caller vouches for `n` bytes.
            unsafe { write_volatile(to.add(i), value as u8) }
        }
        to
    }

    /// # Safety
    /// As of C's `memcmp`.
    #[unsafe(no_mangle)]
    unsafe extern "C" fn memcmp(a: *const u8, b: *const u8, n: usize) -> i32 {
        for i in 0..n {
            // SAFETY: the caller vouches for `n` bytes on both sides.
            let (a, b) = unsafe { (read_volatile(a.add(i)), read_volatile(b.add(i))) };
            if a != b {
                return i32::from(a) - i32::from(b);
            }
        }
        0
    }
}
