//! Known answers.

use super::Form;

mod invariants;
mod layers;
mod linear;
mod slit;
mod smooth;
mod wells;

/// All forms with all of their orders.
const SCHEMES: [(Form, usize); 5] = [
    (Form::InteriorPenalty, 1),
    (Form::InteriorPenalty, 2),
    (Form::InteriorPenalty, 3),
    (Form::OdenBabuskaBaumann, 2),
    (Form::OdenBabuskaBaumann, 3),
];
