//! Messages to a stamp and numbers.

use crate::{
    definition::MessageType,
    wire::{Encoding, Wire, WireFault},
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
