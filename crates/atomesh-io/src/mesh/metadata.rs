//! The frame and the provenance of a mesh as one JSON text, which every format carries.

use atomesh::image::Frame;
use atomesh::mesh::PointGroup;
use serde_json::{Value, json};

use super::provenance::Provenance;
use super::standing::Standing;

/// The array of the number of the group that each point is in, 0 for none, in formats that name their arrays.
pub(super) const POINT_GROUP: &str = "point_group";

/// The name under which formats that name their arrays keep the text.
pub(super) const NAME: &str = "atomesh";

/// The regions and groups of facets that a file knows by other numbers: theirs, and the file's.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct KnownAs {
    pub regions: Vec<(i32, i32)>,
    pub groups: Vec<(u32, i32)>,
}

/// The text with the names of groups of points, which few formats hold, and the numbers by which a format knows
/// regions and groups whose own it cannot hold.
pub(super) fn encode_with_tags<const D: usize>(
    frame: Option<&Frame<D>>,
    provenance: Option<&Provenance>,
    point_groups: &[PointGroup],
    known_as: &KnownAs,
) -> String {
    let mut object = object(frame, provenance);
    if !point_groups.is_empty() {
        let names: Vec<_> = point_groups.iter().map(|group| (group.id, &group.name)).collect();
        object.insert("point_groups".into(), json!(names));
    }
    if !known_as.regions.is_empty() {
        object.insert("regions".into(), json!(known_as.regions));
    }
    if !known_as.groups.is_empty() {
        object.insert("groups".into(), json!(known_as.groups));
    }
    Value::Object(object).to_string()
}

/// The text for a frame and a provenance, as far as they are known.
pub(super) fn encode<const D: usize>(
    frame: Option<&Frame<D>>,
    provenance: Option<&Provenance>,
) -> String {
    Value::Object(object(frame, provenance)).to_string()
}

fn object<const D: usize>(
    frame: Option<&Frame<D>>,
    provenance: Option<&Provenance>,
) -> serde_json::Map<String, Value> {
    let mut object = serde_json::Map::new();
    if let Some(p) = provenance {
        object.insert("version".into(), p.version.clone().into());
        object.insert("seed".into(), p.seed.into());
        object.insert("options".into(), p.options.clone());
        if let Some(standing) = &p.standing {
            object.insert("standing".into(), json!(standing));
        }
        if !p.units.is_empty() {
            object.insert("units".into(), json!(p.units));
        }
    }
    if let Some(f) = frame {
        object.insert(
            "frame".into(),
            json!({
                "shape": f.shape().as_slice(),
                "spacing": f.spacing().as_slice(),
                "origin": f.origin().as_slice(),
                "direction": f.direction().iter().map(<[f64; D]>::as_slice).collect::<Vec<_>>(),
            }),
        );
    }
    object
}

/// What a file's text says, as far as it has the form that [`encode`] gives it.
#[derive(Clone, Debug, Default)]
pub(super) struct Metadata(Value);

impl Metadata {
    /// Reads the text; text that is not JSON says nothing.
    pub fn decode(text: &[u8]) -> Self {
        Self(serde_json::from_slice(text).unwrap_or_default())
    }

    /// Whether atomesh wrote the text.
    pub fn is_ours(&self) -> bool {
        self.0.is_object()
    }

    /// The regions and groups that the file knows by other numbers.
    pub fn known_as(&self) -> KnownAs {
        let list = |name: &str| self.0.get(name).cloned().unwrap_or_default();
        KnownAs {
            regions: serde_json::from_value(list("regions")).unwrap_or_default(),
            groups: serde_json::from_value(list("groups")).unwrap_or_default(),
        }
    }

    /// The numbers and names of groups of points.
    pub fn point_groups(&self) -> Vec<(u32, String)> {
        let names = self.0.get("point_groups").cloned().unwrap_or_default();
        serde_json::from_value(names).unwrap_or_default()
    }

    /// The units of the world's axes.
    fn units(&self) -> Vec<String> {
        let units = self.0.get("units").cloned().unwrap_or_default();
        serde_json::from_value(units).unwrap_or_default()
    }

    /// Where a flat mesh stands in space.
    pub fn standing(&self) -> Option<Standing> {
        let standing: Standing = serde_json::from_value(self.0.get("standing")?.clone()).ok()?;
        // of axes at right angles alone
        let away = |p| standing.in_plane(standing.in_space(p));
        let is_exact = |p: [f64; 2]| {
            let [x, y, off] = away(p);
            (x - p[0]).abs() + (y - p[1]).abs() + off.abs() < 1e-6
        };
        let size = standing.origin.iter().all(|x| x.is_finite());
        (size && is_exact([1.0, 0.0]) && is_exact([0.0, 1.0])).then_some(standing)
    }

    /// The provenance.
    pub fn provenance(&self) -> Option<Provenance> {
        Some(Provenance {
            version: self.0.get("version")?.as_str()?.into(),
            options: self.0.get("options")?.clone(),
            seed: self.0.get("seed")?.as_u64()?,
            units: self.units(),
            standing: self.standing(),
        })
    }

    /// The frame, if it has `D` axes and is a valid one.
    pub fn frame<const D: usize>(&self) -> Option<Frame<D>> {
        let frame = self.0.get("frame")?;
        let shape = axes(frame.get("shape")?, |v| usize::try_from(v.as_u64()?).ok())?;
        let spacing = axes(frame.get("spacing")?, Value::as_f64)?;
        let origin = axes(frame.get("origin")?, Value::as_f64)?;
        let direction = axes(frame.get("direction")?, |row| axes(row, Value::as_f64))?;
        let frame = Frame::new(shape).ok()?;
        frame.with_spacing(spacing).ok()?.with_origin(origin).ok()?.with_direction(direction).ok()
    }
}

/// One value for each axis.
fn axes<T, const D: usize>(value: &Value, read: impl Fn(&Value) -> Option<T>) -> Option<[T; D]> {
    let values: Option<Vec<T>> = value.as_array()?.iter().map(read).collect();
    values?.try_into().ok()
}
