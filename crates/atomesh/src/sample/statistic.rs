//! Statistics of the samples in a cell, and the sums that they are made from.

use std::fmt;
use std::str::FromStr;

/// A number that stands for the samples in a cell, each weighted by its overlap w with the cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum Statistic {
    /// The arithmetic mean, Σ w v / Σ w.
    Mean,
    /// The harmonic mean, Σ w / Σ (w / v); 0 if a sample is 0. For conductances in a row.
    Harmonic,
    /// The geometric mean, exp(Σ w ln v / Σ w); 0 if a sample is 0.
    Geometric,
    /// The standard deviation, √(Σ w (v − mean)² / Σ w).
    Std,
    /// The least sample.
    Min,
    /// The greatest sample.
    Max,
    /// The label that fills the most of the cell; of equal ones the lowest.
    Majority,
    /// The share of the majority's label in the part of the cell that has samples: OOF's homogeneity.
    Homogeneity,
    /// The integral Σ w v, w in world units: a density becomes a mass. 0 without samples.
    Total,
}

impl Statistic {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Mean,
        Self::Harmonic,
        Self::Geometric,
        Self::Std,
        Self::Min,
        Self::Max,
        Self::Majority,
        Self::Homogeneity,
        Self::Total,
    ];

    /// The names of all, as they are spelt in options and fields.
    pub const NAMES: [&'static str; 9] = {
        let mut names = [""; 9];
        let mut i = 0;
        while i < names.len() {
            names[i] = Self::ALL[i].name();
            i += 1;
        }
        names
    };

    /// Its name: lower case, one word.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Mean => "mean",
            Self::Harmonic => "harmonic",
            Self::Geometric => "geometric",
            Self::Std => "std",
            Self::Min => "min",
            Self::Max => "max",
            Self::Majority => "majority",
            Self::Homogeneity => "homogeneity",
            Self::Total => "total",
        }
    }

    /// Whether it takes a logarithm or an inverse, and so needs samples of 0 or more.
    pub fn needs_positive(self) -> bool {
        matches!(self, Self::Harmonic | Self::Geometric)
    }

    /// Whether it counts labels, which are whole numbers.
    pub fn needs_labels(self) -> bool {
        matches!(self, Self::Majority | Self::Homogeneity)
    }
}

impl fmt::Display for Statistic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The error for a name that no statistic has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no statistic is named {name:?}; expected one of {}", Statistic::NAMES.join(", "))]
pub struct UnknownStatistic {
    /// The name found.
    pub name: String,
}

impl FromStr for Statistic {
    type Err = UnknownStatistic;

    fn from_str(name: &str) -> Result<Self, UnknownStatistic> {
        let found = Self::ALL.into_iter().find(|statistic| statistic.name() == name);
        found.ok_or_else(|| UnknownStatistic { name: name.into() })
    }
}

/// Two shares of a cell are equal if they differ by less: roundings of symmetric cells break no tie.
const TIE: f64 = 1e-9;

/// The sums over the samples in one cell.
pub(super) struct Tally {
    positive: bool,
    counts_labels: bool,
    /// Overlaps up to this are slivers or roundings.
    least_overlap: f64,
    /// Σ w v over slivers, which count only in the total.
    slivers: f64,
    /// Σ w.
    pub weight: f64,
    /// The first sample: sums of differences from it keep their digits.
    origin: f64,
    sum: f64,
    squares: f64,
    inverses: f64,
    logarithms: f64,
    min: f64,
    max: f64,
    /// The labels met, ascending, and the overlap of each.
    labels: Vec<(f64, f64)>,
    last_label: usize,
}

impl Tally {
    /// Sums for the statistics.
    pub fn new(statistics: &[Statistic]) -> Self {
        Self {
            positive: statistics.iter().any(|s| s.needs_positive()),
            counts_labels: statistics.iter().any(|s| s.needs_labels()),
            least_overlap: 0.0,
            slivers: 0.0,
            weight: 0.0,
            origin: f64::NAN,
            sum: 0.0,
            squares: 0.0,
            inverses: 0.0,
            logarithms: 0.0,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            labels: Vec::new(),
            last_label: 0,
        }
    }

    /// Begins a cell; overlaps up to `least_overlap` are slivers or roundings.
    pub fn clear(&mut self, least_overlap: f64) {
        let labels = std::mem::take(&mut self.labels);
        let (positive, counts_labels) = (self.positive, self.counts_labels);
        *self = Self { positive, counts_labels, least_overlap, labels, ..Self::new(&[]) };
        self.labels.clear();
    }

    /// Adds a sample; one that is not finite is ignored.
    #[inline]
    pub fn add(&mut self, value: f64, overlap: f64) {
        if !value.is_finite() {
            return;
        }
        if overlap <= self.least_overlap {
            self.slivers += overlap * value;
            return;
        }
        if self.origin.is_nan() {
            self.origin = value;
        }
        let offset = value - self.origin;
        self.weight += overlap;
        self.sum += overlap * offset;
        self.squares += overlap * offset * offset;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        if self.positive {
            self.inverses += overlap / value;
            self.logarithms += overlap * value.ln();
        }
        if self.counts_labels {
            self.add_label(value, overlap);
        }
    }

    fn add_label(&mut self, label: f64, overlap: f64) {
        if self.labels.get(self.last_label).is_none_or(|(known, _)| *known != label) {
            let found = self.labels.binary_search_by(|(known, _)| known.total_cmp(&label));
            self.last_label = found.unwrap_or_else(|place| {
                self.labels.insert(place, (label, 0.0));
                place
            });
        }
        self.labels[self.last_label].1 += overlap;
    }

    /// The label that fills the most, and its overlap.
    fn majority(&self) -> (f64, f64) {
        let greatest = self.labels.iter().fold(0.0_f64, |most, (_, overlap)| most.max(*overlap));
        let enough = greatest - TIE * self.weight;
        let first = self.labels.iter().find(|(_, overlap)| *overlap >= enough);
        first.copied().unwrap_or((f64::NAN, f64::NAN))
    }

    /// The integral over the cell, slivers too, so that nothing is lost; `unit` as in [`value`](Self::value).
    pub fn total(&self, unit: f64) -> f64 {
        let solid = if self.weight > 0.0 { self.origin * self.weight + self.sum } else { 0.0 };
        unit * (solid + self.slivers)
    }

    /// The statistic of a cell that has samples; `unit` is the measure of a box one sample wide.
    pub fn value(&self, statistic: Statistic, unit: f64) -> f64 {
        let weight = self.weight;
        let mean = self.sum / weight;
        match statistic {
            Statistic::Mean => (self.origin + mean).clamp(self.min, self.max),
            Statistic::Harmonic => (weight / self.inverses).clamp(self.min, self.max),
            Statistic::Geometric => (self.logarithms / weight).exp().clamp(self.min, self.max),
            Statistic::Std => (self.squares / weight - mean * mean).max(0.0).sqrt(),
            Statistic::Min => self.min,
            Statistic::Max => self.max,
            Statistic::Majority => self.majority().0,
            Statistic::Homogeneity => (self.majority().1 / weight).min(1.0),
            Statistic::Total => self.total(unit),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A statistic of samples and their overlaps.
    fn of(statistic: Statistic, samples: &[(f64, f64)]) -> f64 {
        let mut tally = Tally::new(&[statistic]);
        tally.clear(1e-9);
        samples.iter().for_each(|&(value, overlap)| tally.add(value, overlap));
        tally.value(statistic, 2.0)
    }

    #[test]
    fn statistics_are_their_formulas() {
        let samples = [(1.0, 0.5), (4.0, 0.25), (2.0, 0.25)];
        let close = |statistic, expected: f64| {
            let found = of(statistic, &samples);
            assert!((found - expected).abs() < 1e-15, "{statistic}: {found}, not {expected}");
        };
        close(Statistic::Mean, 2.0);
        close(Statistic::Harmonic, 1.0 / (0.5 + 0.0625 + 0.125));
        close(Statistic::Geometric, 8.0f64.powf(0.25));
        close(Statistic::Std, 1.5f64.sqrt());
        close(Statistic::Min, 1.0);
        close(Statistic::Max, 4.0);
        close(Statistic::Total, 4.0);
        close(Statistic::Majority, 1.0);
        close(Statistic::Homogeneity, 0.5);
    }

    #[test]
    fn means_lie_in_their_order_and_zeros_count() {
        let samples = [(3.0, 0.2), (5.0, 0.7), (0.25, 1.0)];
        let [h, g, m] = [Statistic::Harmonic, Statistic::Geometric, Statistic::Mean]
            .map(|statistic| of(statistic, &samples));
        assert!(0.25 < h && h < g && g < m && m < 5.0);
        let zero = [(0.0, 1e-3), (5.0, 1.0)];
        assert_eq!((of(Statistic::Harmonic, &zero), of(Statistic::Geometric, &zero)), (0.0, 0.0));
    }

    #[test]
    fn ties_go_to_the_lower_label_even_if_rounded() {
        let even = [(7.0, 0.3 + 1e-16), (-2.0, 0.1), (-2.0, 0.2), (9.0, 0.1)];
        assert_eq!(of(Statistic::Majority, &even), -2.0);
        let uneven = [(7.0, 0.3 + 1e-6), (-2.0, 0.3), (9.0, 0.1)];
        assert_eq!(of(Statistic::Majority, &uneven), 7.0);
    }

    #[test]
    fn the_deviation_of_large_numbers_keeps_its_digits() {
        let samples = [(1e9 + 1.0, 0.5), (1e9 + 3.0, 0.5)];
        assert_eq!(of(Statistic::Std, &samples), 1.0);
    }

    #[test]
    fn what_is_not_finite_and_what_is_rounding_do_not_count() {
        let samples = [(f64::NAN, 0.5), (1.0, 0.25), (f64::INFINITY, 1.0), (-9.0, 1e-12)];
        assert_eq!(of(Statistic::Mean, &samples), 1.0);
        assert_eq!(of(Statistic::Min, &samples), 1.0);
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for statistic in Statistic::ALL {
            assert_eq!(statistic.name().parse(), Ok(statistic));
            assert_eq!(serde_json::to_value(statistic).unwrap(), statistic.name());
        }
        assert!("average".parse::<Statistic>().unwrap_err().to_string().contains("geometric"));
    }
}
