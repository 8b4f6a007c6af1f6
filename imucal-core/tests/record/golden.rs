//! Records and their bytes, put together without the encoder: one of each version.

use imucal_core::nonlinearity::NonlinearTerms;
use imucal_core::record::{
    CalibrationRecord, CurvatureRecord, Date, FirstOrder, FitQuality, HigherOrder, NonlinearRecord,
    Provenance, RawUnit, SensorIdentity, TemperatureQuality, TriadRecord,
};
use imucal_core::temperature::{TemperatureCurvature, TemperatureTerms};

pub const GOLDEN: &[u8] = include_bytes!("../golden/record-1.0.bin");
/// The same whose magnetometer was calibrated earlier, on a unit that did not say its serial.
pub const GOLDEN_1_1: &[u8] = include_bytes!("../golden/record-1.1.bin");
/// The same, with what is known of the accelerometer's temperature terms.
pub const GOLDEN_1_2: &[u8] = include_bytes!("../golden/record-1.2.bin");
/// The same, with terms of higher order of the accelerometer, and of the magnetometer some of them.
pub const GOLDEN_2_0: &[u8] = include_bytes!("../golden/record-2.0.bin");

/// Figures of a real unit, one sensor with temperature terms and one without.
pub fn golden_record() -> CalibrationRecord {
    let quality = FitQuality {
        gain_std: [[1.5e-7, 3.1e-7, 1.1e-6], [0.0, 8.2e-8, 2.9e-7], [0.0, 0.0, 9.2e-8]],
        bias_std: [0.24, 0.14, 0.15],
        rms: 0.00112,
        held_out_rms: Some(0.00125),
        observations: 300,
        parameters: 9,
        condition: 17.3,
        coverage: 0.91,
        field_norm: None,
    };
    let sensor = SensorIdentity { name: "Xsens MTi".parse().unwrap(), serial: "00300017".parse().unwrap() };
    CalibrationRecord {
        acc: Some(TriadRecord {
            gain: [[0.0024130, -8.23e-6, -2.242e-5], [0.0, 0.0024270, -5.153e-5], [0.0, 0.0, 0.0024118]],
            bias: [33123.838, 33275.163, 32364.494],
            unit_in: RawUnit::Counts,
            unit_out: RawUnit::MetrePerSecondSquared,
            model: "T9".parse().unwrap(),
            temperature: Some(TemperatureTerms {
                reference: 25.0,
                bias_slope: [1.5, -0.75, 0.25],
                scale_slope: [1e-4, -2e-4, 5e-5],
            }),
            quality,
            order: FirstOrder,
        }),
        mag: Some(TriadRecord {
            gain: [[1.1, 0.01, 0.02], [0.01, 0.9, -0.03], [0.02, -0.03, 1.0123]],
            bias: [12.5, -40.0, 7.25],
            unit_in: RawUnit::MilliGauss,
            unit_out: RawUnit::Arbitrary,
            model: "E9".parse().unwrap(),
            temperature: None,
            quality: FitQuality { held_out_rms: None, field_norm: Some(475.0), ..quality },
            order: FirstOrder,
        }),
        ..CalibrationRecord::empty(sensor, Date::from_days(20_000))
    }
}

pub fn golden_record_1_1() -> CalibrationRecord {
    let earlier = Provenance { serial: "".parse().unwrap(), date: Date::from_days(19_000) };
    CalibrationRecord { provenance: [None, None, Some(earlier)], ..golden_record() }
}

/// Of a record of first order, which lacks nothing.
pub fn raised(record: CalibrationRecord) -> CalibrationRecord<HigherOrder> {
    let CalibrationRecord { sensor, date, acc, gyr, mag, provenance } = record;
    let [acc, gyr, mag] =
        [acc, gyr, mag].map(|triad| triad.map(|triad| triad.with_order(HigherOrder::default())));
    CalibrationRecord { sensor, date, acc, gyr, mag, provenance }
}

pub fn golden_record_1_2() -> CalibrationRecord<HigherOrder> {
    let mut record = raised(golden_record_1_1());
    record.acc.as_mut().unwrap().order.warmth = Some(TemperatureQuality {
        span: [-5.5, 61.25],
        bias_slope_std: [0.125, 0.25, 0.5],
        scale_slope_std: [1e-6, 2e-6, 0.0],
    });
    record
}

pub fn golden_record_2_0() -> CalibrationRecord<HigherOrder> {
    let mut record = golden_record_1_2();
    let acc = &mut record.acc.as_mut().unwrap().order;
    acc.curvature = Some(CurvatureRecord {
        terms: TemperatureCurvature { bias: [0.015, -0.02, 0.0], scale: [1e-7, -3e-7, 2e-7] },
        std: TemperatureCurvature { bias: [0.001, 0.002, 0.003], scale: [1e-8, 2e-8, 3e-8] },
    });
    acc.nonlinearity = Some(NonlinearRecord {
        range: 20_000.0,
        terms: NonlinearTerms {
            quadratic: [1.5e-7, -2.5e-7, 3.5e-7],
            cubic: [1e-12, -2e-12, 3e-12],
            cross: [[1e-8, 2e-8, 3e-8], [-4e-8, 5e-8, 6e-8], [7e-8, -8e-8, 9e-8]],
        },
        std: NonlinearTerms {
            quadratic: [1e-9, 2e-9, 3e-9],
            cubic: [1e-14, 2e-14, 3e-14],
            cross: [[1e-10; 3], [2e-10; 3], [3e-10; 3]],
        },
    });
    record.mag.as_mut().unwrap().order.nonlinearity = Some(NonlinearRecord {
        range: 600.0,
        terms: NonlinearTerms { cubic: [0.0, 1e-8, 0.0], ..NonlinearTerms::none() },
        std: NonlinearTerms { cubic: [0.0, 2e-9, 0.0], ..NonlinearTerms::none() },
    });
    record
}

/// The bytes of minor 0, put together from the layout drawing without the library's encoder or serde.
pub fn by_hand() -> Vec<u8> {
    framed(1, 0, &payload())
}

/// Those of minor 1.
pub fn by_hand_1_1() -> Vec<u8> {
    framed(1, 1, &payload_1_1())
}

/// Those of minor 2.
pub fn by_hand_1_2() -> Vec<u8> {
    framed(1, 2, &payload_1_2())
}

/// Those of major 2.
pub fn by_hand_2_0() -> Vec<u8> {
    let mut payload = payload_1_2();
    payload.push(1); // accelerometer's curvature: terms, errors
    floats(&mut payload, &[0.015, -0.02, 0.0, 1e-7, -3e-7, 2e-7]);
    floats(&mut payload, &[0.001, 0.002, 0.003, 1e-8, 2e-8, 3e-8]);
    payload.extend([0, 0]); // nothing of the others
    payload.push(1); // accelerometer's nonlinear terms: range, terms, errors
    floats(&mut payload, &[20_000.0]);
    floats(&mut payload, &[1.5e-7, -2.5e-7, 3.5e-7, 1e-12, -2e-12, 3e-12]);
    floats(&mut payload, &[1e-8, 2e-8, 3e-8, -4e-8, 5e-8, 6e-8, 7e-8, -8e-8, 9e-8]);
    floats(&mut payload, &[1e-9, 2e-9, 3e-9, 1e-14, 2e-14, 3e-14]);
    floats(&mut payload, &[1e-10, 1e-10, 1e-10, 2e-10, 2e-10, 2e-10, 3e-10, 3e-10, 3e-10]);
    payload.extend([0, 1]); // none of the gyroscope, and the magnetometer's
    floats(&mut payload, &[600.0]);
    floats(&mut payload, &[0.0, 0.0, 0.0, 0.0, 1e-8, 0.0]);
    floats(&mut payload, &[0.0; 9]);
    floats(&mut payload, &[0.0, 0.0, 0.0, 0.0, 2e-9, 0.0]);
    floats(&mut payload, &[0.0; 9]);
    framed(2, 0, &payload)
}

fn payload_1_1() -> Vec<u8> {
    let mut payload = payload();
    payload.extend([0, 0, 1]); // nothing of its own for accelerometer and gyroscope
    payload.push(0); // no serial
    payload.extend([0xB8, 0x94, 0x01]); // 19 000 days
    payload
}

fn payload_1_2() -> Vec<u8> {
    let mut payload = payload_1_1();
    payload.push(1); // accelerometer: span, errors of the bias slope, of the scale slope
    floats(&mut payload, &[-5.5, 61.25, 0.125, 0.25, 0.5, 1e-6, 2e-6, 0.0]);
    payload.extend([0, 0]); // nothing of the others
    payload
}

fn floats(out: &mut Vec<u8>, figures: &[f32]) {
    figures.iter().for_each(|f| out.extend(f.to_le_bytes()));
}

fn payload() -> Vec<u8> {
    let text = |out: &mut Vec<u8>, text: &str| {
        out.push(text.len() as u8);
        out.extend(text.as_bytes());
    };
    let gain_std = [1.5e-7, 3.1e-7, 1.1e-6, 0.0, 8.2e-8, 2.9e-7, 0.0, 0.0, 9.2e-8];

    let mut payload = Vec::new();
    text(&mut payload, "Xsens MTi");
    text(&mut payload, "00300017");
    payload.extend([0xA0, 0x9C, 0x01]); // 20 000 days

    payload.push(1); // accelerometer
    floats(&mut payload, &[0.0024130, -8.23e-6, -2.242e-5, 0.0, 0.0024270, -5.153e-5, 0.0, 0.0, 0.0024118]);
    floats(&mut payload, &[33123.838, 33275.163, 32364.494]);
    payload.extend([3, 0]); // counts to m/s^2
    text(&mut payload, "T9");
    payload.push(1);
    floats(&mut payload, &[25.0, 1.5, -0.75, 0.25, 1e-4, -2e-4, 5e-5]);
    floats(&mut payload, &gain_std);
    floats(&mut payload, &[0.24, 0.14, 0.15, 0.00112]);
    payload.push(1);
    floats(&mut payload, &[0.00125]);
    payload.extend([0xAC, 0x02, 9]); // 300 observations, 9 parameters
    floats(&mut payload, &[17.3, 0.91]);
    payload.push(0);

    payload.push(0); // no gyroscope

    payload.push(1); // magnetometer
    floats(&mut payload, &[1.1, 0.01, 0.02, 0.01, 0.9, -0.03, 0.02, -0.03, 1.0123]);
    floats(&mut payload, &[12.5, -40.0, 7.25]);
    payload.extend([7, 10]); // mG to a.u.
    text(&mut payload, "E9");
    payload.push(0);
    floats(&mut payload, &gain_std);
    floats(&mut payload, &[0.24, 0.14, 0.15, 0.00112]);
    payload.push(0);
    payload.extend([0xAC, 0x02, 9]);
    floats(&mut payload, &[17.3, 0.91]);
    payload.push(1);
    floats(&mut payload, &[475.0]);
    payload
}

pub fn framed(major: u8, minor: u8, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"IMUC".to_vec();
    bytes.extend([major, minor]);
    bytes.extend((payload.len() as u16).to_le_bytes());
    bytes.extend(payload);
    let checksum = crc32(&bytes);
    bytes.extend(checksum.to_le_bytes());
    bytes
}

/// CRC-32 as its definition has it, bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg()))
    })
}

/// Of minor 0.
pub fn golden_payload() -> &'static [u8] {
    &GOLDEN[8..GOLDEN.len() - 4]
}

/// Of minor 1.
pub fn golden_payload_1_1() -> &'static [u8] {
    &GOLDEN_1_1[8..GOLDEN_1_1.len() - 4]
}

/// Of minor 2.
pub fn golden_payload_1_2() -> &'static [u8] {
    &GOLDEN_1_2[8..GOLDEN_1_2.len() - 4]
}

/// Of major 2.
pub fn golden_payload_2_0() -> &'static [u8] {
    &GOLDEN_2_0[8..GOLDEN_2_0.len() - 4]
}
