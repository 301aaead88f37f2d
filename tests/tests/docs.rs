//! What the pages in the repository say holds: the worked example of docs/adding-an-effect.md compiles, is the one that
//! the page shows, and keeps the contract; the model file of the README is the bundled one; links lead somewhere.

use std::path::Path;

use plants::{
    Dual, EffectInfo, Law, Outlet, ParameterInfo, Place, Plant, Scalar, Scales, Site, Unit,
};

/// Compiled as in the catalogue: its parent has what it uses.
#[path = "../../docs/pipe_height.rs"]
mod pipe_height;

fn torricelli_plant(plant: Plant) -> bool {
    plant.outlet() == Outlet::Torricelli
}

fn scales() -> Scales {
    Scales::from_ranges((0.0, 10.0), (4.0, 20.0), 2.0, 1000.0)
}

fn outflow<T: Scalar>(height: T, level: f64, nominal: f64) -> T {
    let scales = scales();
    let site = Site {
        plant: Plant::SingleTank,
        vessel: 0,
        scales: &scales,
    };
    let mut outflow = T::constant(nominal);
    pipe_height::bind(&site, &[height]).outflow(&T::constant(level), &mut outflow, 0.0);
    outflow
}

#[test]
fn the_page_shows_the_file() {
    let file = include_str!("../../docs/pipe_height.rs");
    let page = include_str!("../../docs/adding-an-effect.md");
    assert!(
        page.contains(&format!("```rust\n{file}```\n")),
        "docs/adding-an-effect.md does not show docs/pipe_height.rs as it stands"
    );
}

#[test]
fn absent_it_changes_nothing_and_present_it_is_its_equation() {
    for level in [-1.0, 0.0, 1e-9, 3e-5, 0.7, 12.3] {
        let nominal = 11.0 * f64::sqrt(level.max(0.0));
        let absent = outflow(0.0, level, nominal);
        assert_eq!(absent.to_bits(), nominal.to_bits(), "at a level of {level}");
    }
    let present = outflow(3.0, 12.0, 11.0 * 12.0_f64.sqrt());
    assert!((present - 11.0 * 15.0_f64.sqrt()).abs() < 1e-12);
}

#[test]
fn its_derivative_at_absent_is_that_of_the_limit() {
    let (level, nominal, step) = (9.0, 33.0, 1e-5);
    let exact = outflow(Dual::<1>::variable(0.0, 0), level, nominal).eps[0];
    let rise = outflow(step, level, nominal) - outflow(-step, level, nominal);
    assert!((exact - rise / (2.0 * step)).abs() < 1e-8);
}

#[test]
fn its_parameters_have_starts_within_their_bounds() {
    let scales = scales();
    let site = Site {
        plant: Plant::SingleTank,
        vessel: 0,
        scales: &scales,
    };
    let parameters: Vec<ParameterInfo> = (pipe_height::INFO.parameters)(&site);
    for p in parameters {
        assert_eq!(p.unit, Unit::LEVEL);
        assert!(p.starts.iter().all(|s| (p.lower..=p.upper).contains(s)));
    }
}

#[test]
fn the_readme_shows_the_bundled_model_file() {
    let readme = include_str!("../../README.md");
    let model = include_str!("../../examples/records/tour.toml");
    assert!(
        readme.contains(&format!("```toml\n{model}```\n")),
        "README.md does not show examples/records/tour.toml as it stands"
    );
}

#[test]
fn model_files_on_the_page_are_read() {
    let page = include_str!("../../docs/model-file.md");
    let blocks: Vec<&str> = page
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next())
        .collect();
    assert_eq!(blocks.len(), 2);
    for block in blocks {
        ctid::model_file::parse("docs/model-file.md", block).unwrap();
    }
    for plant in Plant::ALL {
        assert!(page.contains(&format!("| `{}` |", plant.id())), "{plant:?}");
    }
}

/// Its example is the one of the crate's documentation, which is compiled and run.
#[test]
fn the_readme_shows_the_estimators_example() {
    let readme = include_str!("../../README.md");
    let code = readme
        .split("```rust\n")
        .nth(1)
        .and_then(|rest| rest.split("```").next())
        .unwrap();
    let documented: String = code
        .lines()
        .map(|line| format!("{}\n", format!("/// {line}").trim_end()))
        .collect();
    assert!(
        include_str!("../../crates/ct-rls/src/rls.rs").contains(&documented),
        "README.md shows another example than ContinuousRls"
    );
}

#[test]
fn links_lead_to_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for page in [
        "README.md",
        "CONTRIBUTING.md",
        "benches/README.md",
        "docs/adding-an-effect.md",
        "docs/block-diagonal-gain.md",
        "docs/closed-loop.md",
        "docs/design.md",
        "docs/gallery.md",
        "docs/hidden-dead-zone.md",
        "docs/model-file.md",
    ] {
        let page = root.join(page);
        let text = std::fs::read_to_string(&page).unwrap();
        for link in text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            if link.starts_with("http") || link.starts_with('#') {
                continue;
            }
            let there = page.parent().unwrap().join(link);
            assert!(there.exists(), "{}: no {link}", page.display());
        }
    }
}
