//! Reports: for people (text) and for programs (JSON).

pub mod json;
pub mod measure;
pub mod table;
