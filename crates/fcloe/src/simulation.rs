//! Exact simulation of the loop from its reference, with the sensitivities of its output.
//!
//! Equations. With two chains of `N = deg P = n + deg S` integrators, `x_i = p^i r/P` and `z_i = p^i y^/P`,
//! ```text
//! y^        = B R/P r                      = sum_i [B R]_i x_i
//! sigma_a_i = -S p^i/P y^                  = -sum_j s_j z_{i+j}                  (11)
//! sigma_b_i =  S p^i/P u^ = R p^i (x - z)  =  sum_j r_j (x_{i+j} - z_{i+j})      (9), with S u^ = R (r - y^)
//! ```
//! so the states of two chains in series give all outputs and sensitivities for any number of parameters, and u^, which jumps with r, is
//! not differentiated. In open loop (R = 0, S = 1) u is the input of the first chain, `P = A`, `y^ = B x` and `sigma_b_i = x_i`. The highest
//! derivative, `x_N` or `z_N`, follows from the chain's own equation.
//!
//! The loop is linear, so one matrix exponential of order 2N per set of parameters moves it from sample to sample
//! without error if the drive follows its hold between samples.
//!
//! Start: all states 0, the loop at rest at the operating point.
//!
//! Cost per sample: `3 N^2` products for the states, N for y^, `deg S + 1` or `deg R + 1` for a sensitivity.
//!
//! Reference: Baysse, Carrillo, Habbadi, (4), (9) to (12); the chains are ours.

use ct_lti::{Hold, Polynomial, StateSpace, TransferFunction};

use crate::{ClosedLoop, Controller, Error, PlantModel};

/// Number of samples that are computed at a time.
pub const BLOCK: usize = 64;

/// The simulated signals at up to [`BLOCK`] successive samples.
#[derive(Debug, Clone)]
pub struct Block {
    len: usize,
    y: [f64; BLOCK],
    /// Parameter by parameter.
    sigma: Vec<[f64; BLOCK]>,
    /// `x_0 .. x_N`, `z_0 .. z_N`.
    x: Vec<[f64; BLOCK]>,
    z: Vec<[f64; BLOCK]>,
}

impl Block {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no samples.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// y^, unit of y.
    pub fn y(&self) -> &[f64] {
        &self.y[..self.len]
    }

    /// `dy^/dtheta_j`.
    pub fn sigma(&self, j: usize) -> &[f64] {
        &self.sigma[j][..self.len]
    }
}

/// Simulates one loop.
#[derive(Debug, Clone)]
pub struct LoopSimulator {
    transition: Transition,
    /// y^ as a function of x, and the direct term from the drive.
    output: (Vec<f64>, f64),
    /// u^ likewise.
    input: (Vec<f64>, f64),
    /// P divided by its leading coefficient, which is not stored.
    monic: Vec<f64>,
    /// R and S over P's leading coefficient; R is empty in open loop.
    r: Vec<f64>,
    s: Vec<f64>,
    open_loop: bool,
    n: usize,
    parameters: usize,
    state: State,
    block: Block,
}

#[derive(Debug, Clone)]
struct State {
    x: Vec<f64>,
    z: Vec<f64>,
    drive: Option<f64>,
}

impl LoopSimulator {
    /// At rest, for samples that are `step` apart \[time\]; `hold` is that of the drive: r, or u in open loop.
    ///
    /// # Errors
    /// [`Error::Lti`], as [`ClosedLoop::new`] and for a transition out of range. A loop that is not stable is no error.
    pub fn new(
        plant: &PlantModel,
        controller: &Controller,
        hold: Hold,
        step: f64,
    ) -> Result<Self, Error> {
        let closed = ClosedLoop::new(plant, controller)?;
        Self::of_loop(&closed, plant, controller, hold, step)
    }

    pub(crate) fn of_loop(
        closed: &ClosedLoop,
        plant: &PlantModel,
        controller: &Controller,
        hold: Hold,
        step: f64,
    ) -> Result<Self, Error> {
        let p = closed.characteristic();
        let n = p.degree().unwrap_or(0);
        let leading = p.leading();
        // State i of a controllable form is P's leading coefficient times x_i.
        let first = StateSpace::controllable(&closed.output()?)?;
        let inverse = TransferFunction::new(Polynomial::from(leading), p.clone())?;
        let chains = first.series(&StateSpace::controllable(&inverse)?)?;
        let input = StateSpace::controllable(&closed.input()?)?;
        let over = |p: &Polynomial| p.coefficients().iter().map(|c| c / leading).collect();
        let mut monic: Vec<f64> = over(p);
        monic.pop();
        Ok(Self {
            transition: Transition::new(n, &chains.sampled(hold, step)?),
            output: (first.c().to_vec(), first.d()),
            input: (input.c().to_vec(), input.d()),
            monic,
            r: over(controller.r()),
            s: over(controller.s()),
            open_loop: controller.is_open_loop(),
            n: plant.orders().n,
            parameters: plant.orders().parameters(),
            state: State {
                x: vec![0.0; n],
                z: vec![0.0; n],
                drive: None,
            },
            block: Block {
                len: 0,
                y: [0.0; BLOCK],
                sigma: vec![[0.0; BLOCK]; plant.orders().parameters()],
                x: vec![[0.0; BLOCK]; n + 1],
                z: vec![[0.0; BLOCK]; n + 1],
            },
        })
    }

    /// n + m + 1.
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.state.x.fill(0.0);
        self.state.z.fill(0.0);
        self.state.drive = None;
    }

    /// Takes the drive at the next samples, at most [`BLOCK`] of them (what is beyond is left), and gives y^ and all
    /// sensitivities there. Does not allocate.
    pub fn sensitivities(&mut self, drive: &[f64]) -> &Block {
        let drive = &drive[..drive.len().min(BLOCK)];
        self.chains(drive);
        let Self { block, .. } = self;
        let len = block.len;
        let top = self.monic.len();
        close(&mut block.z, top, &block.y, &self.monic, len);
        let m = self.parameters - self.n - 1;
        if m + self.r.len().max(1) > top {
            let mut input = [0.0; BLOCK];
            input[..len].copy_from_slice(drive);
            close(&mut block.x, top, &input, &self.monic, len);
        }
        let (sigma_a, sigma_b) = block.sigma.split_at_mut(self.n);
        for (i, sigma) in (1..).zip(sigma_a) {
            sigma[..len].fill(0.0);
            for (s, z) in self.s.iter().zip(&block.z[i..]) {
                if *s != 0.0 {
                    add(&mut sigma[..len], -s, z);
                }
            }
        }
        for (i, sigma) in sigma_b.iter_mut().enumerate() {
            sigma[..len].fill(0.0);
            if self.open_loop {
                // S = 1.
                let scale = self.s.first().copied().unwrap_or(0.0);
                add(&mut sigma[..len], scale, &block.x[i]);
                continue;
            }
            for (r, (x, z)) in self.r.iter().zip(block.x[i..].iter().zip(&block.z[i..])) {
                if *r != 0.0 {
                    for (sigma, (x, z)) in sigma[..len].iter_mut().zip(x.iter().zip(z)) {
                        *sigma += r * (x - z);
                    }
                }
            }
        }
        &self.block
    }

    /// y^ at all samples of the drive, from the present state of the loop.
    pub fn outputs(&mut self, drive: &[f64]) -> Vec<f64> {
        let mut y = Vec::with_capacity(drive.len());
        for drive in drive.chunks(BLOCK) {
            self.chains(drive);
            y.extend_from_slice(self.block.y());
        }
        y
    }

    /// y^ and u^ at all samples of the drive, from the present state of the loop; u^ is the command without the sensor's filter.
    pub fn outputs_and_inputs(&mut self, drive: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut y = Vec::with_capacity(drive.len());
        let mut u = Vec::with_capacity(drive.len());
        for drive in drive.chunks(BLOCK) {
            self.chains(drive);
            y.extend_from_slice(self.block.y());
            let mut command = [0.0; BLOCK];
            read(&mut command, &self.input, drive, &self.block.x);
            u.extend_from_slice(&command[..drive.len()]);
        }
        (y, u)
    }

    /// Advances the filter chains by at most [`BLOCK`] samples and computes y^.
    fn chains(&mut self, drive: &[f64]) {
        let Self {
            transition,
            state,
            block,
            ..
        } = self;
        block.len = drive.len();
        transition.run(state, drive, &mut block.x, &mut block.z);
        read(&mut block.y, &self.output, drive, &block.x);
    }
}

/// `y += a x`.
fn add(y: &mut [f64], a: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// An output of the first chain and the drive.
fn read(y: &mut [f64; BLOCK], (c, d): &(Vec<f64>, f64), drive: &[f64], x: &[[f64; BLOCK]]) {
    let y = &mut y[..drive.len()];
    for (y, drive) in y.iter_mut().zip(drive) {
        *y = d * drive;
    }
    for (c, x) in c.iter().zip(x) {
        if *c != 0.0 {
            add(y, *c, x);
        }
    }
}

/// The highest derivative of a chain from its own equation, `x_N = input - sum_i c_i x_i`.
fn close(x: &mut [[f64; BLOCK]], top: usize, input: &[f64; BLOCK], monic: &[f64], len: usize) {
    let (x, highest) = x.split_at_mut(top);
    let Some(highest) = highest.first_mut() else {
        return;
    };
    highest[..len].copy_from_slice(&input[..len]);
    for (c, x) in monic.iter().zip(x) {
        add(&mut highest[..len], -c, x);
    }
}

/// `x+ = Phi x + gx0 r + gx1 r+`, `z+ = Psi x + Phi z + gz0 r + gz1 r+`.
#[derive(Debug, Clone)]
struct Transition {
    n: usize,
    /// Column by column.
    phi: Vec<f64>,
    psi: Vec<f64>,
    g0: Vec<f64>,
    g1: Vec<f64>,
}

impl Transition {
    /// `sampled` has the order 2n.
    fn new(n: usize, sampled: &ct_lti::Sampled) -> Self {
        let block = |row: usize| -> Vec<f64> {
            (0..n)
                .flat_map(|j| (0..n).map(move |i| (i, j)))
                .map(|(i, j)| sampled.phi[(row + i) * 2 * n + j])
                .collect()
        };
        Self {
            n,
            phi: block(0),
            psi: block(n),
            g0: sampled.g0.clone(),
            g1: sampled.g1.clone(),
        }
    }

    fn run(
        &self,
        state: &mut State,
        drive: &[f64],
        x: &mut [[f64; BLOCK]],
        z: &mut [[f64; BLOCK]],
    ) {
        match self.n {
            1 => self.fixed::<1>(state, drive, x, z),
            2 => self.fixed::<2>(state, drive, x, z),
            3 => self.fixed::<3>(state, drive, x, z),
            4 => self.fixed::<4>(state, drive, x, z),
            5 => self.fixed::<5>(state, drive, x, z),
            6 => self.fixed::<6>(state, drive, x, z),
            7 => self.fixed::<7>(state, drive, x, z),
            8 => self.fixed::<8>(state, drive, x, z),
            _ => self.any(state, drive, x, z),
        }
    }

    /// A number of states that is known at compile time: the states stay in processor registers.
    fn fixed<const N: usize>(
        &self,
        state: &mut State,
        drive: &[f64],
        x_out: &mut [[f64; BLOCK]],
        z_out: &mut [[f64; BLOCK]],
    ) {
        let columns = |m: &[f64]| -> [[f64; N]; N] {
            std::array::from_fn(|j| std::array::from_fn(|i| m[j * N + i]))
        };
        let vector = |v: &[f64]| -> [f64; N] { std::array::from_fn(|i| v[i]) };
        let (phi, psi) = (columns(&self.phi), columns(&self.psi));
        let (gx0, gz0) = (vector(&self.g0), vector(&self.g0[N..]));
        let (gx1, gz1) = (vector(&self.g1), vector(&self.g1[N..]));
        let (mut x, mut z) = (vector(&state.x), vector(&state.z));
        let mut last = state.drive;
        for (k, &r) in drive.iter().enumerate() {
            if let Some(last) = last {
                let mut next_x: [f64; N] = std::array::from_fn(|i| gx0[i] * last + gx1[i] * r);
                let mut next_z: [f64; N] = std::array::from_fn(|i| gz0[i] * last + gz1[i] * r);
                for j in 0..N {
                    for i in 0..N {
                        next_x[i] += phi[j][i] * x[j];
                        next_z[i] += psi[j][i] * x[j] + phi[j][i] * z[j];
                    }
                }
                (x, z) = (next_x, next_z);
            }
            last = Some(r);
            for i in 0..N {
                x_out[i][k & (BLOCK - 1)] = x[i];
                z_out[i][k & (BLOCK - 1)] = z[i];
            }
        }
        state.x.copy_from_slice(&x);
        state.z.copy_from_slice(&z);
        state.drive = last;
    }

    fn any(
        &self,
        state: &mut State,
        drive: &[f64],
        x_out: &mut [[f64; BLOCK]],
        z_out: &mut [[f64; BLOCK]],
    ) {
        let n = self.n;
        for (k, &r) in drive.iter().enumerate() {
            if let Some(last) = state.drive {
                let row = |m: &[f64], i: usize, x: &[f64]| -> f64 {
                    x.iter().enumerate().map(|(j, x)| m[j * n + i] * x).sum()
                };
                for i in 0..n {
                    let held = |g: usize| self.g0[g] * last + self.g1[g] * r;
                    x_out[i][k] = held(i) + row(&self.phi, i, &state.x);
                    z_out[i][k] =
                        held(n + i) + row(&self.psi, i, &state.x) + row(&self.phi, i, &state.z);
                }
                for i in 0..n {
                    state.x[i] = x_out[i][k];
                    state.z[i] = z_out[i][k];
                }
            } else {
                for i in 0..n {
                    x_out[i][k] = state.x[i];
                    z_out[i][k] = state.z[i];
                }
            }
            state.drive = Some(r);
        }
    }
}
