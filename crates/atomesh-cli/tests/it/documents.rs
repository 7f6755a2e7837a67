//! The documents say what is there: links lead somewhere, paths name items, commands are run by CI.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the root exists")
}

fn read(path: impl AsRef<Path>) -> String {
    let path = root().join(path);
    fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// The Markdown files of a folder, by their paths from the root.
fn markdown(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).expect("the folder can be listed");
    let names = entries.map(|entry| Path::new(folder).join(entry.expect("an entry").file_name()));
    names.filter(|path| path.extension().is_some_and(|ending| ending == "md")).collect()
}

/// What stands between `open` and `close`, wherever it does.
fn between<'a>(text: &'a str, open: &'a str, close: char) -> impl Iterator<Item = &'a str> {
    text.split(open).skip(1).filter_map(move |rest| rest.split(close).next())
}

/// The lines of the README's block that opens with this line.
fn block(open: &str) -> Vec<String> {
    let text = read("README.md");
    let lines = text.lines().skip_while(|line| *line != open).skip(1);
    lines.take_while(|line| !line.starts_with("```")).map(str::to_owned).collect()
}

/// All pages of the documents.
fn documents() -> Vec<PathBuf> {
    [".", "docs", "docs/tutorials"].into_iter().flat_map(markdown).collect()
}

/// The anchors of a page's headings, as books and forges name them.
fn anchors(page: &str) -> BTreeSet<String> {
    let prose = page.split("```").step_by(2).flat_map(str::lines);
    let headings = prose.filter_map(|line| line.strip_prefix('#'));
    let anchor = |heading: &str| {
        let text = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = text.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn links_lead_to_files_and_headings() {
    let mut count = 0;
    for document in documents() {
        let text = read(&document);
        let folder = root().join(document.parent().expect("a folder"));
        for target in between(&text, "](", ')').filter(|target| !target.contains("://")) {
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() { root().join(&document) } else { folder.join(file) };
            assert!(path.exists(), "{} links to {target}", document.display());
            let has_anchor = || anchors(&read(&path)).contains(anchor);
            assert!(anchor.is_empty() || has_anchor(), "{} links to {target}", document.display());
            count += 1;
        }
    }
    assert!(count > 40, "the documents have links; {count} found");
}

#[test]
fn pictures_say_what_they_show() {
    for document in documents() {
        let text = read(&document);
        for words in between(&text, "![", ']') {
            assert!(
                words.len() > 15,
                "{} has a picture without words: {words}",
                document.display()
            );
        }
    }
}

#[test]
fn every_page_is_in_the_manual() {
    let summary = read("docs/SUMMARY.md");
    for page in markdown("docs").into_iter().chain(markdown("docs/tutorials")) {
        let name = page.strip_prefix("docs").expect("a page of docs").display().to_string();
        let is_listed = summary.contains(&format!("]({name})"));
        assert!(is_listed || matches!(&*name, "SUMMARY.md" | "README.md"), "{name}");
    }
}

/// The options that a text names, as in `--size`.
fn options(text: &str) -> BTreeSet<&str> {
    let named = text.split("--").skip(1).map(|rest| {
        let end = rest.find(|c: char| !c.is_ascii_lowercase() && !c.is_ascii_digit() && c != '-');
        rest[..end.unwrap_or(rest.len())].trim_end_matches('-')
    });
    named.filter(|name| name.len() > 1).collect()
}

#[test]
fn the_manual_has_every_option_and_no_other() {
    let commands = read("docs/commands.md");
    let known = options(&commands);
    assert!(known.len() > 80, "{known:?}");
    // of cargo and gdcmconv; another name of --features, which help mentions in words alone
    let others = BTreeSet::from(["release", "example", "workspace", "open", "raw", "as"]);
    for document in
        documents().iter().filter(|path| path.starts_with("docs") || path.ends_with("README.md"))
    {
        let text = read(document);
        for option in options(&text) {
            let is_known = known.contains(option) || others.contains(option);
            assert!(is_known, "{} names --{option}", document.display());
        }
    }
    // and the reference has what each command's help has
    let commands_of =
        between(&commands, "$ atomesh ", '\n').filter_map(|line| line.strip_suffix(" --help"));
    let listed: BTreeSet<&str> = commands_of.collect();
    let help = read("crates/atomesh-cli/tests/cmd/help.md");
    let list = help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next());
    let names = list.expect("help lists commands").lines().filter_map(|line| {
        let name = line.strip_prefix("  ")?.split(' ').next()?;
        (!name.is_empty() && name != "help").then_some(name)
    });
    assert_eq!(listed, names.collect());
}

#[test]
fn the_method_names_public_items() {
    let text = read("docs/method.md");
    let prose: String = text.split("```").step_by(2).collect();
    let names = between(&prose, "`", '`').filter(|name| name.contains("::"));
    let names: BTreeSet<_> = names.collect();
    assert!(names.len() > 15, "the tables name items; {names:?}");
    for name in names {
        let (path, item) = name.rsplit_once("::").expect("a path");
        let source = match path.strip_prefix("atomesh_draw") {
            Some(rest) => root().join("crates/atomesh-draw/src").join(rest.trim_matches(':')),
            None => match path.strip_prefix("atomesh_flow") {
                Some(rest) => root().join("crates/atomesh-flow/src").join(rest.trim_matches(':')),
                None => root().join("crates/atomesh/src").join(path.replace("::", "/")),
            },
        };
        let code =
            if source.is_dir() { sources(&source) } else { read(source.with_extension("rs")) };
        let defined = ["fn", "struct", "enum", "trait", "const"]
            .iter()
            .any(|kind| code.contains(&format!("pub {kind} {item}")));
        assert!(
            defined,
            "docs/method.md names {name}, which is not public in {}",
            source.display()
        );
    }
}

/// All code of a folder.
fn sources(folder: &Path) -> String {
    let mut code = String::new();
    for entry in fs::read_dir(folder).expect("the folder can be listed") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            code += &sources(&path);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            code += &read(path);
        }
    }
    code
}

#[test]
fn ci_runs_the_commands_of_the_readme() {
    let script = read(".ci/run");
    for mark in ["main", "test", "python", "python-test"] {
        let command = block(&format!("```sh {mark}"));
        assert!(!command.is_empty(), "the README has a block marked {mark}");
        assert!(
            script.contains(&format!("-c \"$(readme {mark})\"")),
            "CI takes the {mark} command from the README"
        );
    }
    assert_eq!(block("```sh test"), ["cargo test --workspace"]);
}

#[test]
fn comments_cite_what_the_references_list() {
    let references = read("REFERENCES.md");
    let crates =
        ["atomesh", "atomesh-flow", "atomesh-io", "atomesh-draw", "atomesh-job", "atomesh-cli"];
    for crate_name in crates {
        let code = sources(&root().join("crates").join(crate_name).join("src"));
        for key in citations(&code) {
            assert!(references.contains(&format!("**{key}**")), "{crate_name} cites {key}");
        }
    }
}

/// Keys such as "Hale 2001" or "Amenta, Choi & Rote 2003", from comments that write them so in
/// parentheses.
fn citations(code: &str) -> BTreeSet<String> {
    let comments: Vec<_> = (code.lines())
        .map(|line| line.trim_start())
        .filter(|line| line.starts_with("//"))
        .map(|line| line.trim_start_matches(['/', '!']).trim())
        .collect();
    let text = comments.join(" ");
    let inside = between(&text, "(", ')').map(str::to_owned);
    let parts = inside.flat_map(|text| {
        // "Bowyer 1981, Watson 1981" is two keys, "Amenta, Choi & Rote 2003, section 2" is one
        let mut keys = Vec::new();
        let mut key = String::new();
        for word in text.split(' ') {
            let bare = word.trim_end_matches([',', ';']);
            if !key.is_empty() {
                key.push(' ');
            }
            if bare.len() == 4 && bare.starts_with(['1', '2']) && bare.parse::<u16>().is_ok() {
                keys.push(std::mem::take(&mut key) + bare);
            } else {
                key += word;
            }
        }
        keys
    });
    let is_name = |word: &str| word == "&" || word.starts_with(char::is_uppercase);
    let is_key = |key: &str| {
        let (names, _) = key.rsplit_once(' ').unwrap_or_default();
        !names.is_empty() && names.split(' ').all(is_name)
    };
    parts.filter(|key| is_key(key)).collect()
}

#[test]
fn citations_are_told_from_other_parentheses() {
    let code = "//! By insertion (Bowyer 1981, Watson 1981); an order (Amenta, Choi\n\
                /// & Rote 2003). It (see section 2) takes (up to 1024) points (1994).\n\
                let x = (Not 1999);\n";
    let found: Vec<_> = citations(code).into_iter().collect();
    assert_eq!(found, ["Amenta, Choi & Rote 2003", "Bowyer 1981", "Watson 1981"]);
}
