//! The options of the run: changed one by one, and spelt as a command.

use std::path::Path;

use atomesh::run::LatticeKind;
use atomesh::watch::Watch;
use atomesh_io::image::write_image;
use atomesh_job::JobError;
use atomesh_job::options::RunConfig;
use serde_json::Value;

use super::Model;
use super::stages::touched;

/// The sections whose options a page may set. None of them holds a name of a file.
const SECTIONS: [&str; 5] = ["lattice", "features", "regions", "optimize", "improve"];

/// The files that painted fields are kept in, beside the log.
const SIZE_FILE: &str = "size.npy";
const WEIGHT_FILE: &str = "weight.npy";

impl<const D: usize> Model<D> {
    /// Gives an option another value; null takes its default.
    pub(super) fn set(
        &mut self,
        option: &str,
        value: &Value,
        watch: &mut dyn Watch,
    ) -> Result<(), JobError> {
        let run = with_option(&self.run, option, value)?;
        check_lattice::<D>(&run)?;
        let stage = touched::<D>(&self.run, &run);
        let before = self.clone();
        self.run = run;
        self.touch(stage);
        // a range of sizes or features of another kind may make another automatic d
        if stage <= super::stages::Touched::Settle {
            self.forget_automatic_size();
        }
        if let Err(error) = self.images(watch) {
            *self = before;
            return Err(error);
        }
        Ok(())
    }

    /// The options as the job takes them: what is painted is not given as a number, but as a file would be.
    pub(super) fn job_run(&self) -> RunConfig {
        let mut run = self.run.clone();
        if self.size_paint.is_some() {
            run.input.size_field = Some(SIZE_FILE.into());
            (run.lattice.size, run.lattice.frequency) = (None, None);
            run.lattice.points_per_wavelength = None;
        }
        if self.weight_paint.is_some() {
            run.input.beta_field = Some(WEIGHT_FILE.into());
            run.lattice.beta = None;
        }
        run
    }

    /// The command that makes the same mesh, as its arguments. Painted fields are written into the session's folder for it.
    /// Where atoms were edited or regions painted by hand, or paint lies on a part of an image, the command replays the log.
    ///
    /// # Errors
    /// [`JobError`] if a field cannot be written.
    pub fn command_line(
        &mut self,
        folder: &Path,
        watch: &mut dyn Watch,
    ) -> Result<Vec<String>, JobError> {
        let is_painted = self.size_paint.is_some() || self.weight_paint.is_some();
        let is_whole = self.run.frame.is_empty();
        let text = |path: &Path| path.display().to_string();
        let is_by_hand = self.is_edited() || self.regions.is_any();
        if is_by_hand || (is_painted && !is_whole) || self.run.input.shown().is_none() {
            let log = text(&folder.join(crate::session::LOG_FILE));
            return Ok(["atomesh", "replay", &log, "-o", "mesh.vtu"].map(Into::into).into());
        }
        let mut run = self.job_run();
        let given = self.painted_fields(watch)?;
        for (field, name, option) in [
            (given.size_field, SIZE_FILE, &mut run.input.size_field),
            (given.weight_field, WEIGHT_FILE, &mut run.input.beta_field),
        ] {
            if let Some(field) = field {
                let path = folder.join(name);
                write_image(&path, &field.image, watch)?;
                *option = Some(path);
            }
        }
        run.output.output = Some("mesh.vtu".into());
        arguments(&run)
    }
}

/// The options with another value of one of them.
///
/// # Errors
/// [`JobError`] if there is no such option that a page may set, or the value is not of its kind.
fn with_option(run: &RunConfig, option: &str, value: &Value) -> Result<RunConfig, JobError> {
    let (section, name) = option
        .split_once('.')
        .filter(|(section, _)| SECTIONS.contains(section))
        .ok_or_else(|| JobError::misuse(format!("there is no option {option:?} to set")))?;
    let mut all = serde_json::to_value(run).map_err(JobError::content)?;
    let table = all.as_object_mut().expect("options are tables");
    let table = table.entry(section).or_insert_with(|| Value::Object(Default::default()));
    let table = table.as_object_mut().expect("sections are tables");
    match value {
        Value::Null => drop(table.remove(name)),
        value => drop(table.insert(name.into(), value.clone())),
    }
    let run: RunConfig = serde_json::from_value(all)
        .map_err(|e| JobError::misuse(format!("{option} = {value}: {e}")))?;
    check_ranges(option, value)?;
    run.check()?;
    Ok(run)
}

/// The ranges that the command line checks and a configuration does not.
fn check_ranges(option: &str, value: &Value) -> Result<(), JobError> {
    let range = match option {
        "lattice.beta" | "features.low" | "features.high" => 0.0..=1.0,
        "lattice.spacing-factor" => 0.1..=1.0,
        "features.scale" | "features.edge-scale" => 0.3..=1000.0,
        "features.denoise" => 0.01..=10.0,
        _ => return Ok(()),
    };
    match value.as_f64() {
        Some(number) if !range.contains(&number) => Err(JobError::misuse(format!(
            "{option} = {number}; expected {} to {}",
            range.start(),
            range.end()
        ))),
        _ => Ok(()),
    }
}

/// Refuses lattices of the other dimension at once.
fn check_lattice<const D: usize>(run: &RunConfig) -> Result<(), JobError> {
    let is_other = match run.lattice.lattice {
        Some(LatticeKind::Hexagonal) => D != 2,
        Some(LatticeKind::Fcc | LatticeKind::Bcc) => D != 3,
        _ => false,
    };
    match run.lattice.lattice {
        Some(kind) if is_other => {
            Err(JobError::misuse(format!("the lattice {} is not of {D} axes", kind.name())))
        }
        _ => Ok(()),
    }
}

/// The command `atomesh mesh` with these options.
fn arguments(run: &RunConfig) -> Result<Vec<String>, JobError> {
    let mut words = vec!["atomesh".to_owned(), "mesh".to_owned()];
    let mut run = run.clone();
    if let Some(image) = run.input.image.take() {
        words.push(image.display().to_string());
    }
    let all = serde_json::to_value(&run).map_err(JobError::content)?;
    let tables = all.as_object().into_iter().flat_map(|tables| tables.values());
    for (name, value) in tables.flat_map(|table| table.as_object().into_iter().flatten()) {
        let option = format!("--{name}");
        match value {
            Value::Array(values) if values.iter().all(Value::is_number) => {
                words.push(format!("{option}={}", joined(values)));
            }
            Value::Array(values) => {
                words.extend(values.iter().map(|value| format!("{option}={}", spelt(value))));
            }
            value => words.push(format!("{option}={}", spelt(value))),
        }
    }
    Ok(words)
}

fn joined(values: &[Value]) -> String {
    values.iter().map(spelt).collect::<Vec<_>>().join(",")
}

fn spelt(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(values) => joined(values),
        value => value.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn a_page_sets_no_files_and_nothing_unknown() {
        let run = RunConfig::default();
        for (option, value) in [
            ("input.image", json!("/etc/passwd")),
            ("input.mask", json!("/etc/passwd")),
            ("output.output", json!("/tmp/x.vtu")),
            ("frame.data-root", json!("/")),
            ("lattice", json!({})),
            ("lattice.nothing", json!(1)),
            ("lattice.beta", json!("x")),
            ("lattice.beta", json!(1.5)),
            ("lattice.size", json!(-1)),
            ("features.features", json!("cats")),
        ] {
            assert!(with_option(&run, option, &value).is_err(), "{option} = {value}");
        }
        let set = with_option(&run, "lattice.size", &json!("6..18")).unwrap();
        assert!(set.lattice.size.is_some());
        assert_eq!(with_option(&set, "lattice.size", &Value::Null).unwrap(), run);
    }

    #[test]
    fn options_are_spelt_as_a_command() {
        let text = "[lattice]\nsize = \"6..18\"\nseed-point = [[1, 2.5], [3, 4]]\n\
                    [features]\nfeatures = \"edges\"\nrepel = true\n[frame]\nspacing = [2, 3]\n";
        let mut run = RunConfig::parse(text).unwrap();
        run.input.image = Some("a b.png".into());
        let mut words = arguments(&run).unwrap();
        assert_eq!(words[..3], ["atomesh", "mesh", "a b.png"]);
        words[3..].sort();
        let expected = [
            "--features=edges",
            "--repel=true",
            "--seed-point=1.0,2.5",
            "--seed-point=3.0,4.0",
            "--size=6.0..18.0",
            "--spacing=2.0,3.0",
        ];
        assert_eq!(words[3..].len(), expected.len(), "{words:?}");
    }
}
