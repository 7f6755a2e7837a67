//! What flows past features where these are not met.

use std::collections::BTreeMap;

use atomesh::run::AcrossFeature;
use serde::Serialize;

/// The least share of all that flows that is said.
const LEAST: f64 = 1e-3;

/// What flows across a feature where it has no facets.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Leak {
    /// What flows across, in all; through the feature that most flows across.
    pub flux: f64,
    /// The same over all that flows.
    pub share: f64,
    /// The place through which most of it flows, in world coordinates.
    pub place: Vec<f64>,
}

/// What flows across the feature that most flows across, but through its barriers; `None` if that is as good as nothing.
///
/// Flow back and forth across one feature, as along a row of facets that winds about it, cancels.
pub(super) fn leak<const D: usize>(
    across: &[AcrossFeature<D>],
    fluxes: &[f64],
    multipliers: &[f64],
    scale: f64,
) -> Option<Leak> {
    let is_open = |facet: &&AcrossFeature<D>| multipliers[facet.facet as usize] == 1.0;
    let flux = |facet: &AcrossFeature<D>| {
        let out = fluxes[facet.facet as usize];
        if facet.is_along { out } else { -out }
    };
    let mut sums: BTreeMap<u32, f64> = BTreeMap::new();
    for facet in across.iter().filter(is_open) {
        *sums.entry(facet.feature).or_default() += flux(facet);
    }
    let (&feature, &sum) = sums.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    if scale <= 0.0 || sum.abs() < LEAST * scale {
        return None;
    }
    let own = across.iter().filter(is_open).filter(|facet| facet.feature == feature);
    let most = own.max_by(|a, b| (flux(a) * sum).total_cmp(&(flux(b) * sum)))?;
    Some(Leak { flux: sum.abs(), share: sum.abs() / scale, place: most.place.to_vec() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_flows_across_open_facets_adds_up_by_its_way() {
        let at = |facet, feature, is_along, x| AcrossFeature {
            facet,
            feature,
            is_along,
            place: [x, 2.0],
        };
        let across =
            [at(0, 0, true, 1.0), at(1, 0, false, 3.0), at(2, 0, true, 5.0), at(3, 1, true, 7.0)];
        let fluxes = [0.2, -0.5, -0.1, 0.4];
        let of = |multipliers: [f64; 4], scale| leak(&across, &fluxes, &multipliers, scale);
        let found = of([1.0; 4], 2.0).unwrap();
        assert!((found.flux - 0.6).abs() < 1e-15 && (found.share - 0.3).abs() < 1e-15);
        assert_eq!(found.place, [3.0, 2.0]);
        // the second facet is a barrier, and what flows across the other two is less than across the other feature
        assert_eq!(of([1.0, 0.0, 1.0, 1.0], 2.0).unwrap().place, [7.0, 2.0]);
        assert_eq!(of([0.0; 4], 2.0), None);
        assert_eq!(of([1.0; 4], 1e4), None);
    }
}
