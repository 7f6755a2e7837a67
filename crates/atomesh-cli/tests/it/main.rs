//! Tests of the command and of the documents, one program so that it is compiled and linked once.

mod calculix;
mod documents;
mod licences;
mod runs;
mod transcripts;
