//! Reports: for people (text) and for programs (JSON).

pub mod capture;
pub mod catalogue;
pub mod compare;
pub mod diagnosis;
pub mod json;
pub mod layout;
pub mod measure;
pub mod model;
pub mod noise;
pub mod prose;
pub mod table;
pub mod temperature;
pub mod terms;
pub mod watch;
