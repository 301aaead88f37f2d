//! Checks of the documents: docs/adding-an-effect.md shows the catalogue's effect that it explains, the gallery is complete, the model file
//! of the README is the bundled one, and links are valid.

use std::path::{Path, PathBuf};

use plants::Plant;

#[test]
fn the_page_shows_the_file() {
    let file = include_str!("../../../crates/plants/src/effects/pipe_height.rs");
    let page = include_str!("../../../docs/adding-an-effect.md");
    assert!(
        page.contains(&format!("```rust\n{file}```\n")),
        "docs/adding-an-effect.md does not show crates/plants/src/effects/pipe_height.rs as it stands"
    );
}

#[test]
fn the_gallery_has_every_effect_in_words_and_in_a_picture() {
    let gallery = include_str!("../../../docs/gallery.md");
    for effect in plants::CATALOGUE {
        let (row, picture) = (format!("| `{}`", effect.id), format!("### `{}`", effect.id));
        assert!(gallery.contains(&row), "no row for {}", effect.id);
        assert!(gallery.contains(&picture), "no picture of {}", effect.id);
    }
}

#[test]
fn the_readme_shows_the_bundled_model_file() {
    let readme = include_str!("../../../README.md");
    let model = include_str!("../../../examples/records/tour.toml");
    assert!(
        readme.contains(&format!("```toml\n{model}```\n")),
        "README.md does not show examples/records/tour.toml as it stands"
    );
}

#[test]
fn model_files_on_the_page_are_read() {
    let page = include_str!("../../../docs/model-file.md");
    let blocks: Vec<&str> = page
        .split("```toml\n")
        .skip(1)
        .filter_map(|rest| rest.split("```").next())
        .collect();
    assert_eq!(blocks.len(), 5);
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
    let readme = include_str!("../../../README.md");
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
        include_str!("../../../crates/ct-rls/src/rls.rs").contains(&documented),
        "README.md shows another example than ContinuousRls"
    );
}

#[test]
fn links_lead_to_files() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut pages: Vec<PathBuf> = [
        "README.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
        "benches/README.md",
    ]
    .map(|page| root.join(page))
    .into();
    let docs = std::fs::read_dir(root.join("docs")).unwrap();
    pages.extend(docs.map(|entry| entry.unwrap().path()));
    pages.retain(|page| page.extension().is_some_and(|extension| extension == "md"));
    assert!(pages.len() > 10, "{pages:?}");
    for page in pages {
        let text = std::fs::read_to_string(&page).unwrap();
        for link in text
            .split("](")
            .skip(1)
            .filter_map(|rest| rest.split(')').next())
        {
            if link.starts_with("http") {
                continue;
            }
            let (file, heading) = link.split_once('#').unwrap_or((link, ""));
            let there = if file.is_empty() {
                page.clone()
            } else {
                page.parent().unwrap().join(file)
            };
            assert!(there.exists(), "{}: no {link}", page.display());
            if !heading.is_empty() {
                let text = std::fs::read_to_string(there).unwrap();
                let found = text
                    .lines()
                    .any(|line| anchor(line) == Some(heading.to_string()));
                assert!(found, "{}: no {link}", page.display());
            }
        }
    }
}

/// Anchor of a heading.
fn anchor(line: &str) -> Option<String> {
    let heading = line.strip_prefix('#')?.trim_start_matches('#').trim();
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    Some(
        heading
            .to_lowercase()
            .chars()
            .filter(kept)
            .collect::<String>()
            .replace(' ', "-"),
    )
}
