//! Runs the transcripts of `tests/cmd/*.md`: what they show is what the command prints.
//!
//! A transcript is a `console` block. `$ ` starts a command, which `sh` runs in a folder of its own for
//! the file; `? N` is the exit code if it is not 0; the rest is what it prints on standard output and
//! standard error. `[..]` stands for any text within a line, a line `...` for any lines. With
//! ATOMESH_UPDATE=1 transcripts that differ are rewritten, to be read before they are kept. `$TOOLS` is the folder of
//! shell functions that make files which the command itself does not write. The README's
//! `console` blocks are one more transcript, which goes on where its main command ends, and so is each page of the manual
//! in `docs`, whose pictures must be those that its blocks make, byte for byte.

#![cfg(unix)]

use std::fmt::Write;
use std::fs;
use std::path::Path;
use std::process::Command;

/// A command and what came of it.
struct Run {
    command: String,
    code: i32,
    output: Vec<String>,
}

impl Run {
    fn text(&self) -> String {
        let mut text = format!("$ {}\n", self.command);
        if self.code != 0 {
            let _ = writeln!(text, "? {}", self.code);
        }
        for line in &self.output {
            let _ = writeln!(text, "{line}");
        }
        text
    }
}

/// The runs of a block's lines.
fn parse(lines: &[&str]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for line in lines {
        if let Some(command) = line.strip_prefix("$ ") {
            runs.push(Run { command: command.into(), code: 0, output: vec![] });
            continue;
        }
        let run = runs.last_mut().expect("a block starts with a command");
        match line.strip_prefix("? ") {
            Some(code) if run.output.is_empty() => run.code = code.parse().expect("an exit code"),
            _ => run.output.push((*line).into()),
        }
    }
    runs
}

/// Runs a command in a folder.
fn execute(command: &str, folder: &Path) -> Run {
    let program = Path::new(env!("CARGO_BIN_EXE_atomesh"));
    let path = std::env::var("PATH").unwrap_or_default();
    let output = Command::new("sh")
        .args(["-c", &format!("exec 2>&1\n{command}")])
        .current_dir(folder)
        .env("PATH", format!("{}:{path}", program.parent().unwrap().display()))
        .env("LC_ALL", "C")
        .env("TOOLS", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/tools"))
        .env_remove("COLUMNS")
        .output()
        .expect("sh runs");
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    Run {
        command: command.into(),
        code: output.status.code().unwrap_or(-1),
        output: text.lines().map(|l| l.trim_end().to_owned()).collect(),
    }
}

/// Whether a line is as a pattern says.
fn line_matches(pattern: &str, line: &str) -> bool {
    let parts: Vec<&str> = pattern.split("[..]").collect();
    let Some(mut rest) = line.strip_prefix(parts[0]) else { return false };
    if parts.len() == 1 {
        return rest.is_empty();
    }
    let last = parts[parts.len() - 1];
    for part in &parts[1..parts.len() - 1] {
        match rest.find(part) {
            Some(at) => rest = &rest[at + part.len()..],
            None => return false,
        }
    }
    rest.ends_with(last)
}

/// Whether lines are as patterns say.
fn matches(patterns: &[String], lines: &[String]) -> bool {
    match (patterns.split_first(), lines.split_first()) {
        (None, None) => true,
        (Some((p, more)), _) if p == "..." => {
            (0..=lines.len()).any(|skip| matches(more, &lines[skip..]))
        }
        (Some((p, more)), Some((l, rest))) => line_matches(p, l) && matches(more, rest),
        _ => false,
    }
}

/// Runs a transcript; returns its text as it should be and what differed.
fn check(text: &str, folder: &Path) -> (String, Vec<String>) {
    let (mut out, mut faults) = (String::new(), Vec::new());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let _ = writeln!(out, "{line}");
        if line != "```console" {
            continue;
        }
        let block: Vec<&str> = lines.by_ref().take_while(|l| *l != "```").collect();
        for expected in parse(&block) {
            let found = execute(&expected.command, folder);
            let same = expected.code == found.code && matches(&expected.output, &found.output);
            if !same {
                faults.push(format!("expected\n{}found\n{}", expected.text(), found.text()));
            }
            out += &if same { expected } else { found }.text();
        }
        out += "```\n";
    }
    (out, faults)
}

#[test]
fn the_command_does_what_the_transcripts_show() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cmd");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    assert!(!paths.is_empty());
    let update = std::env::var_os("ATOMESH_UPDATE").is_some();
    let mut faults = String::new();
    for path in paths {
        let text = fs::read_to_string(&path).unwrap();
        let (found, wrong) = check(&text, tempfile::tempdir().unwrap().path());
        if !wrong.is_empty() && update {
            fs::write(&path, found).unwrap();
        }
        for fault in wrong {
            let _ = writeln!(faults, "{}: {fault}", path.file_name().unwrap().display());
        }
    }
    assert!(faults.is_empty(), "\n{faults}");
}

/// The pictures that a page shows: their files, from its folder.
fn pictures(page: &str) -> impl Iterator<Item = &str> {
    page.split("](")
        .skip(1)
        .filter_map(|rest| rest.split(')').next())
        .filter(|file| file.ends_with(".png"))
}

#[test]
fn the_manual_shows_what_the_command_prints_and_draws() {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs");
    let update = std::env::var_os("ATOMESH_UPDATE").is_some();
    let mut faults = String::new();
    for folder in [docs.clone(), docs.join("tutorials")] {
        let files = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        let mut pages: Vec<_> =
            files.filter(|path| path.extension() == Some("md".as_ref())).collect();
        pages.sort();
        for page in pages {
            let text = fs::read_to_string(&page).unwrap();
            let made = tempfile::tempdir().unwrap();
            let (found, wrong) = check(&text, made.path());
            if !wrong.is_empty() && update {
                fs::write(&page, found).unwrap();
            }
            for fault in wrong {
                let _ = writeln!(faults, "{}: {fault}", page.display());
            }
            // those of the studio are made by its browser tests
            for picture in pictures(&text).filter(|picture| !picture.contains("studio-")) {
                let shown = folder.join(picture);
                let drawn = fs::read(made.path().join(shown.file_name().unwrap()));
                if drawn.is_ok() && drawn.as_ref().ok() == fs::read(&shown).as_ref().ok() {
                    continue;
                }
                match drawn {
                    Ok(bytes) if update => fs::write(&shown, bytes).unwrap(),
                    _ => {
                        let _ = writeln!(
                            faults,
                            "{}: no block draws {picture} as it is",
                            page.display()
                        );
                    }
                }
            }
        }
    }
    assert!(faults.is_empty(), "\n{faults}");
}

#[test]
fn pictures_of_a_page_are_found() {
    let page = "![a](images/b.png) | [c](d.md) ![e f](../g.png)\n[h](i.png)";
    assert_eq!(pictures(page).collect::<Vec<_>>(), ["images/b.png", "../g.png", "i.png"]);
    assert_eq!(pictures("none").count(), 0);
}

/// The README's main command, less the build, as the transcripts run it.
fn main_command(readme: &str) -> String {
    let block = readme.split_once("```sh main\n").expect("the README has a main command").1;
    let command = block.split_once("\n```").expect("its block ends").0;
    let command = command.strip_prefix("cargo build --release && ").expect("it builds first");
    command.replace("target/release/atomesh", "atomesh")
}

#[test]
fn the_readme_shows_what_the_command_prints() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../README.md");
    let text = fs::read_to_string(&path).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let main = execute(&main_command(&text), folder.path());
    assert_eq!(main.code, 0, "{}", main.text());
    let (found, wrong) = check(&text, folder.path());
    if !wrong.is_empty() && std::env::var_os("ATOMESH_UPDATE").is_some() {
        fs::write(&path, found).unwrap();
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn patterns_match_what_they_should_and_no_more() {
    let lines = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    for (pattern, text, expected) in [
        ("a [..] c", "a b c", true),
        ("a [..] c", "a b d", false),
        ("a[..]", "a", true),
        ("a", "a b", false),
        ("a[..]b[..]c", "a1b2c", true),
        ("a[..]b[..]c", "a1c2b", false),
        ("a\n...\nz", "a\nb\nc\nz", true),
        ("a\n...\nz", "a\nb", false),
        ("...", "", true),
        ("a", "a\nb", false),
    ] {
        assert_eq!(matches(&lines(pattern), &lines(text)), expected, "{pattern:?} {text:?}");
    }
}
