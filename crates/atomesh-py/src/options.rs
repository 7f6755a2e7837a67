//! Keywords as the options of a run: the command's names with underscores, but for a few.
//!
//! A keyword's value goes through the same deserialization as a configuration's, so that what is understood, and what
//! is refused, is the same. Images and arrays may stand where the command takes a file.

use atomesh::run::Size;
use atomesh_io::image::AnyImage;
use atomesh_io::mesh::World;
use atomesh_job::mesh::{GivenField, GivenFields};
use atomesh_job::options::RunConfig;
use atomesh_job::values::SizeValue;
use atomesh_job::{Dimension, JobError};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyString};
use serde_json::{Map, Value, json};

use crate::errors::{self, RENAMED};
use crate::image::{self, Image};
use crate::work::How;

/// The sections of options that decide a mesh.
pub const MESH: &[&str] = &["lattice", "features", "regions", "optimize", "improve", "frame"];

/// Keywords that say how the work is done.
const HOW: [&str; 3] = ["progress", "threads", "strict"];

/// Keywords that take images, or names of their files.
const FIELDS: [&str; 5] = ["potential", "size_field", "beta_field", "mask", "labels"];

/// An image beside the one that is meshed.
pub struct Field {
    name: &'static str,
    image: AnyImage,
    world: World,
}

impl Field {
    /// Whether it is given by that keyword.
    pub fn is_named(&self, name: &str) -> bool {
        self.name == name
    }

    /// The image and its world.
    pub fn into_image(self) -> (AnyImage, World) {
        (self.image, self.world)
    }
}

/// What keywords say.
#[derive(Default)]
pub struct Wishes {
    /// The options.
    pub run: RunConfig,
    /// Images in memory.
    pub fields: Vec<Field>,
    /// How the work is done.
    pub how: How,
}

impl Wishes {
    /// Takes the keywords of a function; `sections` are those of the options that it has.
    ///
    /// # Errors
    /// `TypeError` if there is no such keyword, naming the nearest; `InputError` if a value is of no use.
    pub fn take(
        function: &str,
        keywords: Option<&Bound<'_, PyDict>>,
        sections: &[&str],
    ) -> PyResult<Self> {
        Self::default().with(function, keywords, sections)
    }

    /// The same with further keywords, which go before those that were taken.
    ///
    /// # Errors
    /// As [`Wishes::take`].
    pub fn with(
        mut self,
        function: &str,
        keywords: Option<&Bound<'_, PyDict>>,
        sections: &[&str],
    ) -> PyResult<Self> {
        let Some(keywords) = keywords else { return Ok(self) };
        for (key, value) in keywords {
            let key: String = key.extract()?;
            if !known(sections).iter().any(|name| *name == key) {
                return Err(unknown(keywords.py(), function, &key, known(sections)));
            }
            if !value.is_none() {
                self.take_one(&key, &value, sections)?;
            }
        }
        Ok(self)
    }

    fn take_one(&mut self, key: &str, value: &Bound<'_, PyAny>, sections: &[&str]) -> PyResult<()> {
        let py = value.py();
        match key {
            "progress" => self.how.progress = How::progress_of(Some(value))?,
            "threads" => {
                let count: usize = value.extract()?;
                if !(1..=1024).contains(&count) {
                    let message = format!("threads={count}; expected 1 to 1024");
                    return Err(errors::input(py, message));
                }
                self.how.threads = Some(count);
            }
            "strict" => self.how.strict = value.extract()?,
            "size" if is_image(value)? => self.take_field("size_field", value)?,
            "beta" if is_image(value)? => self.take_field("beta_field", value)?,
            _ => match FIELDS.iter().find(|name| **name == key) {
                Some(name) if !image::is_path(value) => self.take_field(name, value)?,
                Some(name) => {
                    let path: std::path::PathBuf = value.extract()?;
                    self.fields.retain(|field| field.name != *name);
                    self.set("input", name, json!(path), key, value)?;
                }
                None => {
                    let option = command_name(key);
                    let of = |names: &[&str]| names.contains(&option);
                    let found = sections_of(sections).find(|(_, names)| of(names));
                    let (section, _) = found.expect("the keyword is known");
                    let worth = spelt(option, value)?;
                    self.set(section, option, worth, key, value)?;
                }
            },
        }
        Ok(())
    }

    fn take_field(&mut self, name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let image = Image::like(value)?;
        let image = image.get();
        self.fields.retain(|field| field.name != name);
        self.fields.push(Field { name, image: image.any().clone(), world: image.world().clone() });
        // a size or weight given as one thing replaces the other
        match name {
            "size_field" => (self.run.lattice.size, self.run.lattice.frequency) = (None, None),
            "beta_field" => self.run.lattice.beta = None,
            _ => {}
        }
        Ok(())
    }

    /// Sets one option from a configuration's value.
    fn set(
        &mut self,
        section: &str,
        option: &str,
        worth: Value,
        key: &str,
        value: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let py = value.py();
        match option {
            "size" | "frequency" => self.fields.retain(|field| field.name != "size_field"),
            "beta" => self.fields.retain(|field| field.name != "beta_field"),
            _ => {}
        }
        let one = Map::from_iter([(option.replace('_', "-"), worth)]);
        let table = Map::from_iter([(section.to_owned(), Value::Object(one))]);
        let partial: RunConfig = serde_json::from_value(Value::Object(table)).map_err(|e| {
            let value = value.repr().map_or("?".into(), |repr| repr.to_string());
            errors::input(py, format!("{key}={value}: {e}"))
        })?;
        let (size, frequency) = (self.run.lattice.size, self.run.lattice.frequency);
        self.run = partial.or(std::mem::take(&mut self.run));
        // one goes before the other, but lengths may bound those of waves
        let is_range = |size: &SizeValue| matches!(size.0, Size::Range { .. });
        let lattice = &mut self.run.lattice;
        match option {
            "size" if lattice.size.as_ref().is_some_and(is_range) => lattice.frequency = frequency,
            "frequency" => lattice.size = size.filter(is_range),
            _ => {}
        }
        Ok(())
    }

    /// Takes labels as the image itself, where no other is given: the boundaries between them are its features. Gives
    /// those in memory.
    pub fn labels_alone(&mut self) -> Option<(AnyImage, World)> {
        let labels = self.fields.iter().find(|field| field.name == "labels");
        if self.run.input.potential.is_some()
            || (labels.is_none() && self.run.input.labels.is_none())
        {
            return None;
        }
        self.run.follow_labels();
        labels.map(|labels| (labels.image.clone(), labels.world.clone()))
    }

    /// The images in memory, for a mesh of `D` axes.
    ///
    /// # Errors
    /// [`JobError`] if one has another number of axes.
    pub fn given<const D: usize>(
        fields: Vec<Field>,
        dimension: &Dimension<D>,
    ) -> Result<GivenFields<D>, JobError> {
        let mut given = GivenFields::default();
        for Field { name, image, world } in fields {
            let found = image.dimension();
            let Some(image) = (dimension.image)(image) else {
                return Err(JobError::content(format!(
                    "{name} has {found} axes; expected {D}, as the image"
                )));
            };
            let field = Some(GivenField { image, units: world.units });
            match name {
                "potential" => given.potential = field,
                "size_field" => given.size_field = field,
                "beta_field" => given.weight_field = field,
                "mask" => given.mask = field,
                _ => given.labels = field,
            }
        }
        Ok(given)
    }
}

/// The sections of that name, with their options.
fn sections_of(
    sections: &[&str],
) -> impl Iterator<Item = &'static (&'static str, &'static [&'static str])> {
    RunConfig::SECTIONS.iter().filter(move |(name, _)| sections.contains(name))
}

/// The command's name for a keyword, with underscores.
fn command_name(key: &str) -> &str {
    let renamed = RENAMED.iter().find(|(_, keyword)| *keyword == key);
    renamed.map_or(key, |(name, _)| name)
}

/// All keywords of a function with these sections of options.
fn known(sections: &[&str]) -> Vec<&'static str> {
    let options = sections_of(sections).flat_map(|(_, names)| names.iter());
    let mut all: Vec<&str> = options.map(|name| errors::keyword(name)).collect();
    all.extend(HOW);
    if sections.contains(&"lattice") {
        all.extend(FIELDS);
    }
    all
}

/// The keywords of `mesh`, or with these sections of options.
#[pyfunction]
#[pyo3(signature = (sections = None))]
pub fn option_names(sections: Option<Vec<String>>) -> Vec<&'static str> {
    match sections {
        None => known(MESH),
        Some(names) => known(&names.iter().map(String::as_str).collect::<Vec<_>>()),
    }
}

/// The `TypeError` for a keyword that there is not, with the nearest that there is.
pub fn unknown(py: Python<'_>, function: &str, key: &str, names: Vec<&str>) -> PyErr {
    let renamed = RENAMED.iter().find(|(name, keyword)| *name == key && names.contains(keyword));
    let nearest = match renamed {
        Some((_, keyword)) => Some((*keyword).to_owned()),
        None => nearest(py, key, names).unwrap_or_default(),
    };
    let hint = nearest.map_or(String::new(), |name| format!("; did you mean {name:?}?"));
    PyTypeError::new_err(format!("{function}() has no keyword {key:?}{hint}"))
}

fn nearest(py: Python<'_>, key: &str, names: Vec<&str>) -> PyResult<Option<String>> {
    let found = py.import("difflib")?.call_method1("get_close_matches", (key, names, 1, 0.5))?;
    Ok(found.extract::<Vec<String>>()?.into_iter().next())
}

/// Whether a value is an image and not a number, a pair or a name.
fn is_image(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    if value.is_instance_of::<Image>() {
        return Ok(true);
    }
    let plain = value.is_instance_of::<PyString>()
        || value.is_instance_of::<PyFloat>()
        || value.is_instance_of::<PyInt>()
        || value.hasattr("__fspath__")?;
    if plain {
        return Ok(false);
    }
    match value.getattr("ndim") {
        Ok(axes) => Ok(axes.extract::<usize>().unwrap_or(0) >= 2),
        // a list or tuple of numbers; all else may be an image of another package
        Err(_) => Ok(value.try_iter().is_err()),
    }
}

/// A value as a configuration spells it.
fn spelt(option: &str, value: &Bound<'_, PyAny>) -> PyResult<Value> {
    let listed = value.try_iter().is_ok() && !value.is_instance_of::<PyString>();
    match option {
        "size" if listed => {
            let ends = pair(value)?;
            Ok(Value::String(format!("{}..{}", ends[0], ends[1])))
        }
        "crop" if listed => {
            let ranges: PyResult<Vec<String>> = value
                .try_iter()?
                .map(|range| pair(&range?).map(|ends| format!("{}..{}", ends[0], ends[1])))
                .collect();
            Ok(Value::String(ranges?.join(",")))
        }
        "features" if value.is_instance_of::<PyDict>() => {
            let weights = value.cast::<PyDict>()?;
            let names: Vec<String> = weights.iter().map(|(k, v)| format!("{k}:{v}")).collect();
            Ok(Value::String(names.join(",")))
        }
        "features" if listed => {
            let names: PyResult<Vec<String>> =
                value.try_iter()?.map(|name| name?.extract()).collect();
            Ok(Value::String(names?.join(",")))
        }
        "direction" => Ok(json!(crate::arrays::numbers(value)?)),
        "threshold" if !listed => Ok(json!([value.extract::<f64>()?])),
        "void" | "only" if listed => {
            let labels: PyResult<Vec<String>> =
                value.try_iter()?.map(|label| Ok(label?.extract::<i32>()?.to_string())).collect();
            Ok(Value::String(labels?.join(",")))
        }
        "void" | "only" => Ok(Value::String(value.extract::<i32>()?.to_string())),
        "size_of" | "material" => {
            let by_label = value.cast::<PyDict>()?.iter();
            let spelt = |(label, of): (Bound<'_, PyAny>, Bound<'_, PyAny>)| -> PyResult<String> {
                let label = label.extract::<i32>()?;
                match of.extract::<f64>() {
                    Ok(one) => Ok(format!("{label}={one}")),
                    Err(_) => pair(&of).map(|two| format!("{label}={},{}", two[0], two[1])),
                }
            };
            Ok(json!(by_label.map(spelt).collect::<PyResult<Vec<String>>>()?))
        }
        _ => to_json(value),
    }
}

/// Two numbers.
fn pair(value: &Bound<'_, PyAny>) -> PyResult<[f64; 2]> {
    let ends: PyResult<Vec<f64>> = value.try_iter()?.map(|end| end?.extract()).collect();
    let ends = ends?;
    <[f64; 2]>::try_from(ends)
        .map_err(|ends| errors::input(value.py(), format!("{} numbers; expected two", ends.len())))
}

/// A number, text, or list of these as JSON.
fn to_json(value: &Bound<'_, PyAny>) -> PyResult<Value> {
    if value.is_instance_of::<PyBool>() {
        return Ok(json!(value.extract::<bool>()?));
    }
    if let Ok(text) = value.extract::<String>() {
        return Ok(json!(text));
    }
    if value.hasattr("__fspath__")? {
        return Ok(json!(value.extract::<std::path::PathBuf>()?));
    }
    if value.hasattr("tolist")? {
        return to_json(&value.call_method0("tolist")?);
    }
    if let Ok(number) = value.extract::<i64>() {
        return Ok(json!(number));
    }
    if let Ok(number) = value.extract::<u64>() {
        return Ok(json!(number));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(json!(number));
    }
    let items: PyResult<Vec<Value>> = value.try_iter()?.map(|item| to_json(&item?)).collect();
    Ok(Value::Array(items?))
}
