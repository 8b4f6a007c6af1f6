//! The co-processor's logic, tested where it can be watched: on the host, with simulated flash and a bad link.

mod nor;
mod storage;
