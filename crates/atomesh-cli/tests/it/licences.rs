//! Everything that is linked into the command may be used under a permissive licence.

use std::process::Command;

/// Licences that ask for no more than a notice.
const PERMISSIVE: [&str; 12] = [
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
];

/// Whether every part of an SPDX expression leaves a permissive choice. `AND` is split first, which
/// for expressions without parentheses is stricter than SPDX.
fn is_permissive(expression: &str) -> bool {
    let expression = expression.replace('/', " OR ");
    expression.split(" AND ").all(|part| {
        let part = part.trim_matches(|c| matches!(c, '(' | ')' | ' '));
        part.split(" OR ").any(|choice| PERMISSIVE.contains(&choice.trim()))
    })
}

#[test]
fn expressions_are_read_as_choices() {
    for good in
        ["MIT", "MIT/Apache-2.0", "LGPL-2.1-or-later OR MIT", "(MIT OR Zlib) AND Unicode-3.0"]
    {
        assert!(is_permissive(good), "{good}");
    }
    for bad in [
        "",
        "GPL-3.0",
        "AGPL-3.0-only",
        "LGPL-2.1-or-later",
        "MIT AND GPL-2.0",
        "GPL-2.0 OR GPL-3.0",
    ] {
        assert!(!is_permissive(bad), "{bad}");
    }
}

#[test]
fn every_linked_crate_is_permissively_licensed() {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--package", "atomesh-cli", "--edges", "normal,build", "--prefix", "none"])
        .args(["--format", "{p}|{l}", "--no-dedupe", "--offline"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs, since it runs this test");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let tree = String::from_utf8(output.stdout).expect("cargo prints UTF-8");
    let crates: Vec<_> = tree.lines().filter_map(|line| line.split_once('|')).collect();
    assert!(crates.len() > 20, "cargo tree lists the dependencies: {tree}");
    let others: Vec<_> = crates.iter().filter(|(_, licence)| !is_permissive(licence)).collect();
    assert!(others.is_empty(), "not permissively licensed: {others:?}");
}
