//! What a well's cells exchange with their surroundings.

use super::options::Porosity;
use super::pieces::FluxField;

/// The flow out of and into a well's cells through the facets around them, and the volume of their pores.
pub struct WellExchange {
    pub outward: f64,
    pub inward: f64,
    pub pores: f64,
}

impl WellExchange {
    pub fn new<const D: usize>(
        field: &FluxField<'_, D>,
        cells: &[u32],
        porosity: &Porosity<'_>,
    ) -> Self {
        let mut own = Self { outward: 0.0, inward: 0.0, pores: 0.0 };
        for &cell in cells {
            let cell = cell as usize;
            own.pores += porosity.of(cell) * field.grid.measures()[cell];
            for &facet in field.grid.facets_of(cell) {
                let beyond = field.beyond(cell, facet as usize);
                if beyond.is_some_and(|other| cells.binary_search(&other).is_ok()) {
                    continue;
                }
                let flux = field.out_of(cell, facet as usize);
                own.outward += flux.max(0.0);
                own.inward += (-flux).max(0.0);
            }
        }
        own
    }
}
