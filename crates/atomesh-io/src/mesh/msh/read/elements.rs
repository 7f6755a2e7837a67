//! The cells of an MSH file, and lines and triangles of its groups.

use super::super::super::format::{MshEncoding, MshVersion};
use super::super::super::read_error::{MeshReadError, malformed};
use super::Reader;

/// What stands before the corners of a cell.
#[derive(Clone, Copy)]
struct Element {
    /// Gmsh's type.
    kind: i32,
    tag: u64,
    /// How many corners follow.
    corners: usize,
}

impl Reader<'_> {
    pub fn elements(&mut self) -> Result<(), MeshReadError> {
        match self.version {
            MshVersion::V41 => self.elements_41()?,
            MshVersion::V22 => self.elements_22()?,
        }
        self.cell_of.close();
        Ok(())
    }

    fn elements_41(&mut self) -> Result<(), MeshReadError> {
        let blocks = self.count("blocks of cells")?;
        for _ in 0..3 {
            self.size()?; // cells, least and greatest tag
        }
        for _ in 0..blocks {
            let entity = (self.from.int()?, self.from.int()?);
            let physicals = self.physicals.get(&entity).cloned().unwrap_or_default();
            let kind = self.from.int()?;
            let corners = self.corner_count(kind)?;
            for _ in 0..self.count("cells")? {
                let tag = self.size()?;
                self.cell_of.push(tag);
                self.cell(Element { kind, tag, corners }, &physicals, Self::size)?;
            }
        }
        Ok(())
    }

    fn elements_22(&mut self) -> Result<(), MeshReadError> {
        let count = self.text_count("cells")?;
        let mut done = 0;
        while done < count {
            let text = self.from.encoding == MshEncoding::Text;
            let mut tag = if text { self.from.int()? } else { 0 };
            let kind = self.from.int()?;
            let corners = self.corner_count(kind)?;
            let following = if text { 1 } else { self.from.int()? };
            let following = self.from.bounded(following.max(0) as u64, "cells")?;
            let tags = self.from.int()?;
            if following == 0 {
                return Err(self.from.expected("cells in this block"));
            }
            for _ in 0..following {
                if !text {
                    tag = self.from.int()?;
                }
                let mut physical = [0];
                for k in 0..tags {
                    let value = self.from.int()?;
                    if k == 0 {
                        physical = [value.saturating_abs()];
                    }
                }
                let physicals = &physical[..usize::from(physical[0] != 0)];
                let tag = self.tag(tag)?;
                self.cell_of.push(tag);
                self.cell(Element { kind, tag, corners }, physicals, |reader| {
                    let tag = reader.from.int()?;
                    reader.tag(tag)
                })?;
            }
            done += following;
        }
        Ok(())
    }

    fn corner_count(&self, kind: i32) -> Result<usize, MeshReadError> {
        corner_count(kind).ok_or_else(|| MeshReadError::Unsupported {
            what: "cell type",
            found: kind.to_string(),
            expected: "one of Gmsh's numbers 1 to 31",
        })
    }

    /// Reads the corners of a cell, and keeps it if it is a triangle, a tetrahedron, or a line or point of a physical
    /// group.
    fn cell(
        &mut self,
        element: Element,
        physicals: &[i32],
        read: impl Fn(&mut Self) -> Result<u64, MeshReadError>,
    ) -> Result<(), MeshReadError> {
        let Element { kind, tag, corners } = element;
        let mut cell = [0; 4];
        // of cells of second order the corners, which come first
        let is_quadratic = matches!(kind, 8 | 9 | 11);
        let kind = match kind {
            8 => 1,
            9 => 2,
            11 => 4,
            _ => kind,
        };
        self.parts.has_quadratic |= is_quadratic;
        for k in 0..corners {
            let tag = read(self)?;
            if matches!(kind, 1 | 2 | 4 | 15) && k < corners_of(kind) {
                let index = self.index_of.index(tag);
                cell[k] = index.ok_or_else(|| {
                    malformed(self.from.at, "a point's tag before this", tag.to_string())
                })?;
            }
        }
        let [a, b, c, _] = cell;
        let region = physicals.first().copied().unwrap_or(0);
        let tags = &mut self.parts.tags;
        tags.has_regions |= region != 0 && !matches!(kind, 1 | 15);
        match kind {
            15 if region != 0 => {
                self.parts.cell_kinds.push(0);
                tags.points.push((a, region));
            }
            1 if region != 0 => {
                self.parts.cell_kinds.push(0);
                tags.edges.extend(physicals.iter().map(|&id| ([a, b], id)));
            }
            2 => {
                tags.triangle_regions.push(region);
                tags.facet_cells += usize::from(region != 0);
                tags.triangles.extend(physicals.iter().map(|&id| ([a, b, c], id)));
                self.cell_tags[0].push(tag);
                self.parts.add_triangle(&cell[..3]);
            }
            4 => {
                tags.tetrahedron_regions.push(region);
                self.cell_tags[1].push(tag);
                self.parts.add_tetrahedron(&cell);
            }
            _ => self.parts.skip_cell(),
        }
        Ok(())
    }
}

/// How many corners a point (Gmsh's type 15), a line (1), a triangle (2) or a tetrahedron (4) has.
fn corners_of(kind: i32) -> usize {
    match kind {
        15 => 1,
        1 => 2,
        2 => 3,
        _ => 4,
    }
}

/// How many points a cell of Gmsh's type has.
fn corner_count(kind: i32) -> Option<usize> {
    const COUNTS: [usize; 31] = [
        2, 3, 4, 4, 8, 6, 5, 3, 6, 9, 10, 27, 18, 14, 1, 8, 20, 15, 13, 9, 10, 12, 15, 15, 21, 4,
        5, 6, 20, 35, 56,
    ];
    COUNTS.get(usize::try_from(kind).ok()?.checked_sub(1)?).copied()
}
