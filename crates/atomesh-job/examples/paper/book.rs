//! Where figures go: their pictures, captions and checked numbers.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};

use atomesh::image::Image;
use atomesh::mesh::Mesh;
use atomesh::synth::{Scene, SynthOptions, synthesize};
use atomesh::watch::Silent;
use atomesh_draw::{Picture, PictureFormat, Style, draw_triangles};
use atomesh_io::image::{AnyImage, ReadOptions, read_image};
use atomesh_job::mesh::MeshImages;
use atomesh_job::options::RunConfig;
use atomesh_job::{Dimension, Session};

/// What can go wrong: anything, with its reason.
pub type Failure = Box<dyn std::error::Error>;

/// A figure's number in its caption, and its bounds.
pub struct Checked<'a> {
    /// What it is.
    pub name: &'a str,
    pub value: f64,
    /// The least and the greatest value that the figure may have.
    pub range: [f64; 2],
}

/// A folder of figures.
pub struct Book {
    folder: PathBuf,
    /// Where the papers' images are.
    data: Option<PathBuf>,
    captions: String,
}

impl Book {
    /// Makes the folder.
    pub fn new(folder: PathBuf, data: Option<PathBuf>) -> Result<Self, Failure> {
        fs::create_dir_all(&folder)?;
        Ok(Self { folder, data, captions: "# The papers' figures\n".to_owned() })
    }

    /// Whether the papers' own images are taken.
    pub fn has(&self, file: &str) -> bool {
        self.data.as_ref().is_some_and(|folder| folder.join(file).exists())
    }

    /// The papers' image of that name; without it a scene drawn by the program.
    pub fn flat(&self, file: &str, scene: Scene, shape: [usize; 2]) -> Result<Image<2>, Failure> {
        match self.read(file)? {
            Some(AnyImage::Flat(image)) => Ok(image),
            Some(AnyImage::Volume(_)) => Err(format!("{file} is a volume").into()),
            None => Ok(synthesize(scene, &SynthOptions::new(shape))?.image),
        }
    }

    /// The papers' image of that name, if it is there.
    pub fn read(&self, file: &str) -> Result<Option<AnyImage>, Failure> {
        let Some(folder) = self.data.as_ref().filter(|_| self.has(file)) else { return Ok(None) };
        let image = read_image(&folder.join(file), &ReadOptions::default(), &mut Silent)?;
        Ok(Some(image))
    }

    /// Writes a figure, `options` as the command has them, and checks its number.
    pub fn add(
        &mut self,
        name: &str,
        caption: &str,
        options: &str,
        picture: &Picture,
        checked: &[Checked<'_>],
    ) -> Result<(), Failure> {
        let file = format!("{name}.png");
        fs::write(self.folder.join(&file), picture.encode(PictureFormat::Png)?)?;
        write!(self.captions, "\n## {}\n\n![{caption}]({file})\n\n{caption}.", title(name))?;
        if !options.is_empty() {
            write!(self.captions, " Options: `{options}`.")?;
        }
        for Checked { name: what, value, range: [least, greatest] } in checked {
            println!("{name}: {what} {value:.4}");
            write!(self.captions, " {what}: {value:.4}.")?;
            if !(least..=greatest).contains(&value) {
                return Err(
                    format!("{name}: {what} is {value}; expected {least} to {greatest}").into()
                );
            }
        }
        self.captions.push('\n');
        Ok(())
    }

    /// Writes the captions.
    pub fn finish(self) -> Result<(), Failure> {
        let path = self.folder.join("index.md");
        fs::write(&path, self.captions)?;
        println!("{}", Path::new(&path).display());
        Ok(())
    }
}

/// A figure's heading.
fn title(name: &str) -> String {
    let mut title = name.replace('-', " ");
    title[..1].make_ascii_uppercase();
    title
}

/// A run's options, written as the command has them, as in `--size 8 --beta 0.3`.
pub fn run(options: &str) -> Result<RunConfig, Failure> {
    let mut tables = std::collections::BTreeMap::<&str, String>::new();
    let mut words = options.split_whitespace();
    while let Some(word) = words.next() {
        let (name, value) = match word.trim_start_matches("--").split_once('=') {
            Some(pair) => pair,
            None => {
                (word.trim_start_matches("--"), words.next().ok_or("an option without a value")?)
            }
        };
        let field = name.replace('-', "_");
        let has = |section: &&(&'static str, &[&str])| section.1.contains(&field.as_str());
        let section =
            RunConfig::SECTIONS.iter().find(has).ok_or_else(|| format!("no option --{name}"))?;
        let is_plain =
            value.parse::<f64>().is_ok() && name != "size" || matches!(value, "true" | "false");
        let value = if is_plain { value.to_owned() } else { format!("{value:?}") };
        writeln!(tables.entry(section.0).or_default(), "{name} = {value}")?;
    }
    let text: String = tables.iter().map(|(name, lines)| format!("[{name}]\n{lines}")).collect();
    Ok(RunConfig::parse(&text)?)
}

/// Meshes an image.
pub fn mesh<const D: usize>(
    options: &str,
    image: &Image<D>,
    dimension: &Dimension<D>,
) -> Result<atomesh::run::Outcome<D>, Failure> {
    let mut watch = Silent;
    let mut session = Session::new(&mut watch);
    let images = MeshImages::new(image.clone());
    Ok(atomesh_job::mesh::mesh(&run(options)?, images, dimension, &mut session)?)
}

/// An image as it is.
pub fn plain(image: &Image<2>) -> Result<Picture, Failure> {
    let style = Style { edges: false, brightness: 1.0, max_side: 768.0, ..Style::default() };
    Ok(draw_triangles(image, &Mesh::new(Vec::new(), Vec::new())?, &style)?)
}

/// Places in sample coordinates as white dots on a field.
pub fn dots(field: &Image<2>, atoms: Vec<[f64; 2]>) -> Result<Picture, Failure> {
    let style =
        Style { edges: false, atoms: true, max_side: 768.0, edge_width: 1.6, ..Style::default() };
    Ok(draw_triangles(field, &Mesh::new(atoms, Vec::new())?, &style)?)
}
