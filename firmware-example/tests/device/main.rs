//! The co-processor's logic, tested where it can be watched: on the host, with simulated flash and a bad link.

mod adapter;
mod axes;
mod bad_link;
mod bench;
mod capture;
mod hostile_line;
mod nor;
mod rate;
mod session;
mod storage;
mod uart_ring;
mod warmth;
