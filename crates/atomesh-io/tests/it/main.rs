//! Tests of files, one program so that what they share is compiled and linked once.

mod brought;
mod cell_exports;
mod cell_files;
mod cell_values;
mod dicom;
mod flow_files;
mod foam_mesh;
mod hostile;
mod image_bad_input;
mod image_round_trip;
mod mesh_files;
mod quadratic_files;
mod real_images;
mod scans;
mod simulators;
mod standing;
mod surfaces;
mod tags;
