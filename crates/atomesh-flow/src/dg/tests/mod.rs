//! Known answers.

mod linear;
mod smooth;
