//! Calibrate IMU recordings through `imucal-core`.
