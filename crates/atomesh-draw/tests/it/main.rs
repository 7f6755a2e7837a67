//! Tests of pictures, one program so that what they share is compiled and linked once.

mod flow_pictures;
mod pictures;
mod pixels;
mod space_pictures;
