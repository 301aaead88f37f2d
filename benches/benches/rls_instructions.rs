//! Instructions of 1000 recursive least squares updates, counted by valgrind: the same on any machine of the same kind,
//! however busy.
//!
//! Wants valgrind and `cargo install gungraun-runner --version 0.20.0`; says that it skips where the runner is missing.
#![allow(missing_docs, clippy::expect_used)]

mod rls_cases;

use std::process::Command;

/// A prepared run over the samples; it is built before the counting begins.
type Run = Box<dyn FnMut() -> f64>;

mod counted {
    use std::hint::black_box;

    use gungraun::{library_benchmark, library_benchmark_group};

    use super::Run;
    use crate::rls_cases::{Dsmc, Dynamic, Factored, Operators, samples};

    fn ct_rls<const P: usize>() -> Run {
        let (samples, mut who) = (samples::<P>(), Factored::<P>::new());
        Box::new(move || who.run(&samples))
    }

    fn directional<const P: usize>() -> Run {
        let (samples, mut who) = (samples::<P>(), Factored::<P, _>::directional());
        Box::new(move || who.run(&samples))
    }

    fn walk_of_one<const P: usize>() -> Run {
        let (samples, mut who) = (samples::<P>(), Factored::<P, _>::walk(1));
        Box::new(move || who.run(&samples))
    }

    fn run_time_size<const P: usize>() -> Run {
        let (samples, mut who) = (samples::<P>(), Dynamic::new(P));
        Box::new(move || who.run(&samples))
    }

    fn operators<const P: usize>() -> Run {
        let (samples, mut who) = (samples::<P>(), Operators::<P>::new());
        Box::new(move || who.run(&samples))
    }

    fn dsmc<const P: usize>() -> Run {
        let (samples, mut who) = (samples::<P>(), Dsmc::new(P));
        Box::new(move || who.run(&samples))
    }

    #[library_benchmark]
    #[bench::ct_rls_2(ct_rls::<2>())]
    #[bench::ct_rls_5(ct_rls::<5>())]
    #[bench::ct_rls_10(ct_rls::<10>())]
    #[bench::directional_2(directional::<2>())]
    #[bench::directional_5(directional::<5>())]
    #[bench::directional_10(directional::<10>())]
    #[bench::walk_of_one_2(walk_of_one::<2>())]
    #[bench::walk_of_one_5(walk_of_one::<5>())]
    #[bench::walk_of_one_10(walk_of_one::<10>())]
    #[bench::run_time_size_2(run_time_size::<2>())]
    #[bench::run_time_size_5(run_time_size::<5>())]
    #[bench::run_time_size_10(run_time_size::<10>())]
    #[bench::operators_2(operators::<2>())]
    #[bench::operators_5(operators::<5>())]
    #[bench::operators_10(operators::<10>())]
    #[bench::dsmc_2(dsmc::<2>())]
    #[bench::dsmc_5(dsmc::<5>())]
    #[bench::dsmc_10(dsmc::<10>())]
    fn updates(mut run: Run) -> Run {
        black_box(run());
        // given back, so that it is not dropped while counting
        run
    }

    library_benchmark_group!(name = rls; benchmarks = updates);
    gungraun::main!(library_benchmark_groups = rls);

    pub fn run() {
        main();
    }
}

fn main() {
    let runner = std::env::var("GUNGRAUN_RUNNER").unwrap_or_else(|_| "gungraun-runner".into());
    if Command::new(&runner).arg("--version").output().is_err() {
        println!(
            "skipped: {runner} does not start; `cargo install gungraun-runner --version 0.20.0`"
        );
        return;
    }
    counted::run();
}
