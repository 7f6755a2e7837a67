//! The form of discontinuous Galerkin, and its options.

use crate::error::FlowError;
use crate::solve::SolveOptions;

/// The highest order.
pub(super) const MOST_ORDER: usize = 3;

/// A form of discontinuous Galerkin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Form {
    /// Symmetric interior penalty (Arnold 1982) with weighted means (Ern, Stephansen & Zunino 2009). The equations are
    /// symmetric positive definite; stable from degree 1; the error in L² is of order p + 1.
    #[default]
    #[serde(rename = "sipg")]
    InteriorPenalty,
    /// Oden, Babuška & Baumann (1998), whom Hale (2001) follows. No penalty; the equations are not symmetric; stable
    /// from degree 2; the error in L² is of order p + 1 for odd p, p for even p.
    #[serde(rename = "obb")]
    OdenBabuskaBaumann,
}

impl Form {
    /// All forms.
    pub const ALL: [Self; 2] = [Self::InteriorPenalty, Self::OdenBabuskaBaumann];

    /// A short lower-case name: `sipg` or `obb`.
    pub fn name(self) -> &'static str {
        match self {
            Self::InteriorPenalty => "sipg",
            Self::OdenBabuskaBaumann => "obb",
        }
    }

    /// The lowest order that is stable.
    pub fn least_order(self) -> usize {
        match self {
            Self::InteriorPenalty => 1,
            Self::OdenBabuskaBaumann => 2,
        }
    }
}

/// An unknown name of a form.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no form is named {0:?}; known are sipg, obb")]
pub struct UnknownForm(pub String);

impl std::str::FromStr for Form {
    type Err = UnknownForm;

    fn from_str(name: &str) -> Result<Self, UnknownForm> {
        let found = Self::ALL.into_iter().find(|form| form.name() == name);
        found.ok_or_else(|| UnknownForm(name.to_string()))
    }
}

/// Options of [`solve()`](super::solve()).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct DgOptions {
    /// The form. Default symmetric interior penalty: stable from order 1, and symmetric.
    pub form: Form,
    /// The degree p of the polynomials: 1 to 3, with Oden, Babuška and Baumann's form 2 or 3. Default 2, more accurate
    /// than degree 1 with twice as many unknowns: the measured error of the jump across a slit is 0.5 % with cells of
    /// 1/10 of its half length, 0.8 % by degree 1 with cells of 1/20.
    pub order: usize,
    /// The penalty, relative to the least that is proven to be stable on any mesh with any permeability; 1 or more.
    /// Default 1.5: of 1, 1.5, 2 and 4 it has the least error of the jump across a slit, at every degree.
    pub penalty: f64,
    /// How the equations are solved.
    pub solve: SolveOptions,
}

impl Default for DgOptions {
    fn default() -> Self {
        Self { form: Form::InteriorPenalty, order: 2, penalty: 1.5, solve: SolveOptions::default() }
    }
}

impl DgOptions {
    pub(super) fn check(&self) -> Result<(), FlowError> {
        let least = self.form.least_order();
        if !(least..=MOST_ORDER).contains(&self.order) {
            let (found, form) = (self.order, self.form.name());
            return Err(FlowError::Order { found, form, least, most: MOST_ORDER });
        }
        if !(self.penalty >= 1.0 && self.penalty.is_finite()) {
            return Err(FlowError::Penalty { value: self.penalty });
        }
        Ok(())
    }
}
