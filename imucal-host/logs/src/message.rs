//! Messages to a stamp and numbers.

use crate::{
    definition::MessageType,
    wire::{Cdr, Encoding, Wire, WireFault},
};

const PER_S: i64 = 1_000_000_000;

/// What the messages of a topic say.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// Specific force, rate and, where the sensor estimates it, attitude.
    Imu,
    /// Magnetic field.
    MagneticField,
    /// Temperature.
    Temperature,
    /// Position and attitude of a body.
    Pose,
}

impl Kind {
    /// What each column of a [`Stream`](crate::Stream) is: m/s², rad/s, T, °C, m; quaternions scalar first, body → frame.
    #[must_use]
    pub fn columns(self) -> &'static [&'static str] {
        match self {
            Self::Imu => &["acc_x", "acc_y", "acc_z", "gyr_x", "gyr_y", "gyr_z", "q_w", "q_x", "q_y", "q_z"],
            Self::MagneticField => &["mag_x", "mag_y", "mag_z"],
            Self::Temperature => &["temperature"],
            Self::Pose => &["p_x", "p_y", "p_z", "q_w", "q_x", "q_y", "q_z"],
        }
    }
}

impl MessageType {
    /// The message that is written of a kind.
    pub(crate) fn written(kind: Kind) -> Self {
        match kind {
            Kind::Imu => Self::Imu,
            Kind::MagneticField => Self::MagneticField,
            Kind::Temperature => Self::Temperature,
            Kind::Pose => Self::PoseStamped,
        }
    }

    pub(crate) fn kind(self) -> Kind {
        match self {
            Self::Imu => Kind::Imu,
            Self::MagneticField => Kind::MagneticField,
            Self::Temperature => Kind::Temperature,
            Self::PoseStamped | Self::PoseWithCovarianceStamped | Self::Odometry => Kind::Pose,
        }
    }
}

/// A message's content.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decoded<'a> {
    pub(crate) stamp_ns: i64,
    pub(crate) frame: &'a str,
    /// The body of a pose, where the message names it.
    pub(crate) child: Option<&'a str>,
    /// As [`Kind::columns`] has them.
    pub(crate) values: Vec<f64>,
}

/// Reads a message of a type.
pub(crate) fn decode(known: MessageType, encoding: Encoding, data: &[u8]) -> Result<Decoded<'_>, WireFault> {
    let mut wire = Wire::new(data, encoding)?;
    let stamp_ns = stamp(&mut wire)?;
    let frame = wire.text()?;
    let mut child = None;
    let values = match known {
        MessageType::Imu => imu(&mut wire)?,
        MessageType::MagneticField => {
            let field = wire.f64s::<3>()?;
            known_or_nan(field, wire.f64s::<9>()?).to_vec()
        }
        MessageType::Temperature => {
            let temperature = wire.f64()?;
            wire.f64()?;
            vec![temperature]
        }
        MessageType::PoseStamped => pose(&mut wire)?,
        MessageType::PoseWithCovarianceStamped => {
            let values = pose(&mut wire)?;
            wire.f64s::<36>()?;
            values
        }
        MessageType::Odometry => {
            child = Some(wire.text()?);
            let values = pose(&mut wire)?;
            wire.f64s::<36>()?;
            wire.f64s::<42>()?;
            values
        }
    };
    wire.end()?;
    Ok(Decoded { stamp_ns, frame, child, values })
}

/// A message in CDR of numbers as [`Kind::columns`] has them; none where they are not so many, or no message has the stamp.
/// What is NaN as a whole is said to be unknown.
pub(crate) fn encode(kind: Kind, stamp_ns: i64, frame: &str, values: &[f64]) -> Option<Vec<u8>> {
    let mut cdr = Cdr::new();
    cdr.u32(i32::try_from(stamp_ns.div_euclid(PER_S)).ok()?.cast_unsigned());
    cdr.u32(u32::try_from(stamp_ns.rem_euclid(PER_S)).ok()?);
    cdr.text(frame);
    match (kind, values) {
        (Kind::Imu, [a_x, a_y, a_z, w_x, w_y, w_z, q_w, q_x, q_y, q_z]) => {
            put_known(&mut cdr, &[*q_x, *q_y, *q_z, *q_w]);
            put_known(&mut cdr, &[*w_x, *w_y, *w_z]);
            put_known(&mut cdr, &[*a_x, *a_y, *a_z]);
        }
        (Kind::MagneticField, [_, _, _]) => put_known(&mut cdr, values),
        (Kind::Temperature, [temperature]) => cdr.f64s(&[*temperature, 0.0]),
        (Kind::Pose, [p_x, p_y, p_z, q_w, q_x, q_y, q_z]) => {
            cdr.f64s(&[*p_x, *p_y, *p_z, *q_x, *q_y, *q_z, *q_w]);
        }
        _ => return None,
    }
    Some(cdr.bytes())
}

/// Numbers with a covariance of zeros, which is an unknown one, or of a measurement that there is not.
fn put_known(cdr: &mut Cdr, values: &[f64]) {
    let known = !values.iter().all(|value| value.is_nan());
    values.iter().for_each(|value| cdr.f64s(&[if known { *value } else { 0.0 }]));
    cdr.f64s(&[if known { 0.0 } else { -1.0 }]);
    cdr.f64s(&[0.0; 8]);
}

fn stamp(wire: &mut Wire<'_>) -> Result<i64, WireFault> {
    let seconds = match wire.encoding() {
        Encoding::Ros1 => {
            wire.u32()?;
            i64::from(wire.u32()?)
        }
        Encoding::Cdr => i64::from(wire.i32()?),
    };
    let nanoseconds = i64::from(wire.u32()?);
    if nanoseconds >= PER_S {
        return Err(WireFault::new(format!("a stamp with {nanoseconds} ns"), "less than a second of them"));
    }
    Ok(seconds * PER_S + nanoseconds)
}

fn imu(wire: &mut Wire<'_>) -> Result<Vec<f64>, WireFault> {
    let orientation = attitude(wire)?;
    let orientation = known_or_nan(orientation, wire.f64s::<9>()?);
    let rate = wire.f64s::<3>()?;
    let rate = known_or_nan(rate, wire.f64s::<9>()?);
    let force = wire.f64s::<3>()?;
    let force = known_or_nan(force, wire.f64s::<9>()?);
    Ok(force.into_iter().chain(rate).chain(orientation).collect())
}

fn pose(wire: &mut Wire<'_>) -> Result<Vec<f64>, WireFault> {
    let position = wire.f64s::<3>()?;
    Ok(position.into_iter().chain(attitude(wire)?).collect())
}

/// Scalar first; all zero is no rotation.
fn attitude(wire: &mut Wire<'_>) -> Result<[f64; 4], WireFault> {
    let [x, y, z, w] = wire.f64s::<4>()?;
    Ok(if [x, y, z, w].iter().all(|part| *part == 0.0) { [f64::NAN; 4] } else { [w, x, y, z] })
}

/// A covariance that begins with −1 says that there is no such measurement.
fn known_or_nan<const N: usize, const M: usize>(values: [f64; N], covariance: [f64; M]) -> [f64; N] {
    if covariance.first() == Some(&-1.0) { [f64::NAN; N] } else { values }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ROS 1's bytes of numbers behind a header.
    fn message(stamp: [u32; 2], values: &[f64]) -> Vec<u8> {
        let mut bytes = vec![0; 4];
        stamp.iter().for_each(|part| bytes.extend(part.to_le_bytes()));
        bytes.extend([3, 0, 0, 0, b'i', b'm', b'u']);
        values.iter().for_each(|value| bytes.extend(value.to_le_bytes()));
        bytes
    }

    fn imu_of(quaternion: [f64; 4], covariances: [f64; 3]) -> Vec<f64> {
        let cov = |first: f64| [first, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let values = [
            &quaternion[..],
            &cov(covariances[0]),
            &[4.0, 5.0, 6.0],
            &cov(covariances[1]),
            &[1.0, 2.0, 3.0],
            &cov(covariances[2]),
        ]
        .concat();
        let bytes = message([5, 7], &values);
        let found = decode(MessageType::Imu, Encoding::Ros1, &bytes).unwrap();
        assert_eq!((found.stamp_ns, found.frame, found.child), (5_000_000_007, "imu", None));
        found.values
    }

    #[test]
    fn force_rate_and_attitude_stand_in_their_columns() {
        let found = imu_of([0.1, 0.2, 0.3, 0.9], [0.0; 3]);
        assert_eq!(found, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.9, 0.1, 0.2, 0.3]);
        assert_eq!(found.len(), Kind::Imu.columns().len());
    }

    #[test]
    fn what_is_written_is_read_and_what_is_nan_as_a_whole_is_unknown() {
        let nan = f64::NAN;
        let all: [(Kind, &[f64]); 5] = [
            (Kind::Imu, &[1.0, nan, 3.0, 4.0, 5.0, 6.0, 0.5, -0.5, 0.5, -0.5]),
            (Kind::Imu, &[nan, nan, nan, 4.0, 5.0, 6.0, nan, nan, nan, nan]),
            (Kind::MagneticField, &[1e-5, 2e-5, -3e-5]),
            (Kind::Temperature, &[21.5]),
            (Kind::Pose, &[1.0, 2.0, 3.0, 0.5, -0.5, 0.5, -0.5]),
        ];
        for (kind, values) in all {
            // Frames of several lengths pad the numbers after them.
            for (stamp, frame) in
                [(0, ""), (5_000_000_007, "imu"), (i64::from(i32::MAX) * PER_S, "imu_link_ned")]
            {
                let bytes = encode(kind, stamp, frame, values).unwrap();
                let found = decode(MessageType::written(kind), Encoding::Cdr, &bytes).unwrap();
                assert_eq!((found.stamp_ns, found.frame), (stamp, frame));
                let same = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
                assert_eq!(found.values.len(), values.len());
                assert!(found.values.iter().zip(values).all(same), "{:?} {values:?}", found.values);
            }
            assert_eq!(encode(kind, 0, "", &[]), None);
            assert_eq!(encode(kind, (i64::from(i32::MAX) + 1) * PER_S, "", values), None);
        }
    }

    #[test]
    fn what_a_message_does_not_know_is_nan() {
        let is_nan = |values: &[f64]| values.iter().all(|value| value.is_nan());
        assert!(is_nan(&imu_of([0.0; 4], [0.0; 3])[6..]));
        assert!(is_nan(&imu_of([0.0, 0.0, 0.0, 1.0], [-1.0, 0.0, 0.0])[6..]));
        let silent = imu_of([0.0, 0.0, 0.0, 1.0], [0.0, -1.0, 0.0]);
        assert!(is_nan(&silent[3..6]) && silent[0] == 1.0 && silent[6] == 1.0);
        assert!(is_nan(&imu_of([0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -1.0])[..3]));
    }

    #[test]
    fn a_message_that_is_cut_too_long_or_badly_stamped_is_a_fault() {
        let whole = message([5, 7], &[20.0, 0.0]);
        assert!(decode(MessageType::Temperature, Encoding::Ros1, &whole).is_ok());
        for end in 0..whole.len() {
            assert!(decode(MessageType::Temperature, Encoding::Ros1, &whole[..end]).is_err(), "{end}");
        }
        assert!(decode(MessageType::Temperature, Encoding::Ros1, &[&whole[..], &[0]].concat()).is_err());
        let late = message([5, 1_000_000_000], &[20.0, 0.0]);
        assert!(decode(MessageType::Temperature, Encoding::Ros1, &late).unwrap_err().found.contains("stamp"));
    }
}
