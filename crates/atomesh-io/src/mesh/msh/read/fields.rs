//! Values at the points or in the cells of an MSH file.

use super::super::super::field::OwnedField;
use super::super::super::read_error::{MeshReadError, malformed};
use super::Reader;

/// What stands before the values of a field.
struct FieldHead {
    name: String,
    /// The numbers of a value.
    components: u64,
    /// How many values there are.
    count: u64,
}

impl Reader<'_> {
    /// Keeps a scalar field that has a value for every point, or for every cell or all of one kind.
    pub fn field(&mut self, of_cells: bool) -> Result<(), MeshReadError> {
        let FieldHead { name, components, count } = self.field_head()?;
        let count = self.from.bounded(count, "values")?;
        let (tags, all) = match of_cells {
            true => (&self.cell_of, self.parts.cell_kinds.len()),
            false => (&self.index_of, self.parts.points.len()),
        };
        let triangles = self.parts.triangles.len() / 3;
        let kept = [all, triangles, self.parts.tetrahedra.len() / 4];
        let whole = if of_cells { kept.contains(&count) } else { count == all };
        let keep = components == 1 && whole && !name.is_empty();
        let mut values = vec![f64::NAN; if keep { all } else { 0 }];
        for _ in 0..count {
            let tag = self.from.int()?;
            let tag = u64::try_from(tag)
                .map_err(|_| malformed(self.from.at, "a tag of 0 or more", tag.to_string()))?;
            let index = tags.index(tag);
            for _ in 0..components {
                let value = self.from.real()?;
                if let Some(slot) = index.and_then(|i| values.get_mut(i as usize)) {
                    *slot = value;
                }
            }
        }
        if !keep {
            self.parts.skip_field(&name);
        } else if of_cells {
            self.parts.cell_fields.push(OwnedField { name, values });
        } else {
            let values = values.into_iter().map(|v| v as f32).collect();
            self.parts.fields.push(OwnedField { name, values });
        }
        Ok(())
    }

    fn field_head(&mut self) -> Result<FieldHead, MeshReadError> {
        let mut name = "";
        for i in 0..self.text_count("strings")? {
            let line = self.from.line()?;
            if i == 0 {
                name = line.trim_matches('"');
            }
        }
        for _ in 0..self.text_count("real numbers")? {
            self.from.line()?;
        }
        let mut integers = Vec::new();
        for _ in 0..self.text_count("integers")? {
            let line = self.from.line()?;
            let value = line.parse::<u64>();
            integers.push(value.map_err(|_| malformed(self.from.at, "a count before this", line))?);
        }
        let [_, components, count, ..] = integers[..] else {
            return Err(self.from.expected("three integers before this"));
        };
        Ok(FieldHead { name: name.into(), components, count })
    }
}
