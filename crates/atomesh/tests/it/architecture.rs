//! The modules' order: each names only modules above it in `lib.rs`.

use std::fs;
use std::path::{Path, PathBuf};

const SOURCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src");

/// The modules in the order in which `lib.rs` lists them.
fn modules(lib: &str) -> Vec<String> {
    (lib.lines())
        .map(|line| line.trim().trim_start_matches("pub "))
        .filter_map(|line| line.strip_prefix("mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

/// Every source file of a module: `name.rs`, or all under `name/`.
fn files(name: &str) -> Vec<PathBuf> {
    let file = Path::new(SOURCE).join(format!("{name}.rs"));
    let mut found = if file.is_file() { vec![file] } else { Vec::new() };
    let mut folders = vec![Path::new(SOURCE).join(name)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(&folder).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found
}

/// The modules that a source names after `crate::`, also in a braced list; comments may link anywhere.
fn named(source: &str) -> Vec<String> {
    let code: Vec<&str> =
        source.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
    let source = code.join("\n");
    let mut names = Vec::new();
    for (at, word) in source.match_indices("crate::") {
        // `$crate::` and `my_crate::` are other things
        if source[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        let rest = &source[at + word.len()..];
        match rest.strip_prefix('{') {
            None => names.push(first_word(rest)),
            Some(list) => {
                let (mut depth, mut start) = (0, 0);
                for (i, c) in list.char_indices() {
                    match c {
                        '{' => depth += 1,
                        '}' if depth > 0 => depth -= 1,
                        ',' | '}' if depth == 0 => {
                            names.push(first_word(list[start..i].trim_start()));
                            start = i + 1;
                            if c == '}' {
                                break;
                            }
                        }
                        _ => {}
                    }
                }
            }
        }
    }
    names.retain(|name| !name.is_empty());
    names
}

fn first_word(text: &str) -> String {
    text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
}

#[test]
fn names_are_found_wherever_they_stand() {
    let source =
        "use crate::a::B;\nuse crate::{c, d::{E, f}, g::H};\nlet x = crate::i::j(); $crate::k!()";
    assert_eq!(named(source), ["a", "c", "d", "g", "i"]);
    assert_eq!(named("use crate::{a::{b, c}};\n/// See [`crate::d`]."), ["a"]);
}

#[test]
fn each_module_names_only_modules_above_it() {
    let modules = modules(&fs::read_to_string(Path::new(SOURCE).join("lib.rs")).unwrap());
    assert!(modules.len() > 10, "{modules:?}");
    let mut faults = Vec::new();
    for (place, module) in modules.iter().enumerate() {
        let files = files(module);
        assert!(!files.is_empty(), "{module} has no source");
        for file in files {
            for name in named(&fs::read_to_string(&file).unwrap()) {
                match modules.iter().position(|m| *m == name) {
                    Some(other) if other <= place => {}
                    Some(_) => faults.push(format!("{}: {module} names {name}", file.display())),
                    None => faults.push(format!("{}: no module {name}", file.display())),
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn every_source_file_belongs_to_a_listed_module() {
    let modules = modules(&fs::read_to_string(Path::new(SOURCE).join("lib.rs")).unwrap());
    for entry in fs::read_dir(SOURCE).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        assert!(name == "lib" || modules.contains(&name), "{} is not in lib.rs", path.display());
    }
}
