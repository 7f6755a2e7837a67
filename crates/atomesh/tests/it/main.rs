//! Tests of the library as a whole, one program so that it is compiled and linked once.

mod architecture;
mod regions;
mod sphere;
