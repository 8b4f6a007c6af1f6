//! What a column of another program probably is called here.

use crate::recording::manifest::spelling;

/// Bytes of the longest name that is taken for one of a column.
const LONGEST: usize = 60;

/// Other words for the first part of a name.
const PARTS: [(&str, &str); 15] = [
    ("linearacceleration", "acc"),
    ("accelerometer", "acc"),
    ("acceleration", "acc"),
    ("accel", "acc"),
    ("angularvelocity", "gyr"),
    ("angularrate", "gyr"),
    ("gyroscope", "gyr"),
    ("gyro", "gyr"),
    ("magnetometer", "mag"),
    ("magneticfield", "mag"),
    ("magn", "mag"),
    ("temperature", "temp"),
    ("quat", "refq"),
    ("refposition", "refp"),
    ("refpos", "refp"),
];

/// Whole names.
const WHOLE: [(&str, &str); 18] = [
    ("time", "t"),
    ("timestamp", "t"),
    ("ax", "accx"),
    ("ay", "accy"),
    ("az", "accz"),
    ("gx", "gyrx"),
    ("gy", "gyry"),
    ("gz", "gyrz"),
    ("wx", "gyrx"),
    ("wy", "gyry"),
    ("wz", "gyrz"),
    ("mx", "magx"),
    ("my", "magy"),
    ("mz", "magz"),
    ("qw", "refqw"),
    ("qx", "refqx"),
    ("qy", "refqy"),
    ("qz", "refqz"),
];

/// Units that stand behind a name, of the quantities whose names begin so, and as the manifest has them.
const UNITS: [(&str, &[(&str, &str)]); 6] = [
    (
        "acc",
        &[
            ("ms2", "m/s^2"),
            ("mps2", "m/s^2"),
            ("mss", "m/s^2"),
            ("mg", "mg"),
            ("g", "g"),
            ("counts", "counts"),
            ("lsb", "counts"),
            ("raw", "counts"),
        ],
    ),
    (
        "gyr",
        &[
            ("rads", "rad/s"),
            ("radps", "rad/s"),
            ("radsec", "rad/s"),
            ("degs", "deg/s"),
            ("degps", "deg/s"),
            ("degsec", "deg/s"),
            ("dps", "deg/s"),
            ("counts", "counts"),
            ("lsb", "counts"),
            ("raw", "counts"),
        ],
    ),
    (
        "mag",
        &[
            ("ut", "uT"),
            ("µt", "uT"),
            ("nt", "nT"),
            ("mg", "mG"),
            ("mgauss", "mG"),
            ("g", "G"),
            ("gauss", "G"),
            ("counts", "counts"),
            ("lsb", "counts"),
            ("raw", "counts"),
        ],
    ),
    ("temp", &[("c", "degC"), ("degc", "degC"), ("°c", "degC"), ("celsius", "degC")]),
    ("gimbal", &[("rad", "rad"), ("deg", "deg")]),
    (
        "t",
        &[
            ("s", "s"),
            ("sec", "s"),
            ("secs", "s"),
            ("seconds", "s"),
            ("ms", "ms"),
            ("msec", "ms"),
            ("us", "us"),
            ("µs", "us"),
            ("usec", "us"),
            ("ns", "ns"),
            ("nsec", "ns"),
        ],
    ),
];

/// The unit, as the manifest has it, that stands apart behind a column's name: `ax_g`, `Gyro X [deg/s]`, `timestamp_ms`.
/// In `mag` the g does not.
pub(crate) fn unit_behind(quantity: &str, name: &str) -> Option<&'static str> {
    let (_, units) = UNITS.iter().find(|(known, _)| *known == quantity)?;
    let (_, last) = name.trim_end_matches([']', ')', ' ']).rsplit_once([' ', '_', '[', '('])?;
    let last = bare(last);
    units.iter().find(|(ending, _)| *ending == last).map(|(_, unit)| *unit)
}

/// The absent column that an unknown name probably means, and whether a unit stands behind the name.
pub(crate) fn meant(name: &str, absent: &[&'static str]) -> Option<(&'static str, bool)> {
    if name.len() > LONGEST {
        return None;
    }
    let bare = bare(name);
    let same = |known: &&&'static str| of_simulator(&super::column_guess::bare(known)) == of_simulator(&bare);
    if let Some(known) = absent.iter().find(same) {
        return Some((known, false));
    }
    if let Some(known) = absent.iter().find(|known| is_with_unit(&bare, known)) {
        return Some((known, true));
    }
    // In a short name two edits make anything of anything.
    let near = |shortest: usize, edits| {
        let long = absent.iter().copied().filter(move |known| known.len() >= shortest);
        spelling::nearest(name, long.filter(|known| may_be_near(&bare, known, edits)), edits)
    };
    near(4, 1).or_else(|| near(5, 2)).map(|known| (known, false))
}

/// Whether so many edits may make a known column of a bare name. A simulator and a reference have other quantities too,
/// of names as like (`sim_time`, `ref_vx`).
fn may_be_near(bare: &str, known: &str, edits: usize) -> bool {
    match known {
        "ref_px" | "ref_py" | "ref_pz" => edits < 2 && bare.contains('p'),
        "ref_qw" | "ref_qx" | "ref_qy" | "ref_qz" => !bare.starts_with("refp"),
        known => edits < 2 || !known.starts_with("sim_"),
    }
}

/// Whether a bare name is one of a simulator's columns, and the rest of it in this program's words.
fn of_simulator(bare: &str) -> (bool, String) {
    let rest = bare.strip_prefix("simulated").or_else(|| bare.strip_prefix("sim"));
    (rest.is_some(), plain(rest.unwrap_or(bare)))
}

/// Letters and digits in lower case.
fn bare(name: &str) -> String {
    name.chars().filter(|c| c.is_alphanumeric() || *c == '°').flat_map(char::to_lowercase).collect()
}

/// Whether a bare name is a known column with a unit behind it.
fn is_with_unit(bare: &str, known: &str) -> bool {
    let units = UNITS.iter().filter(|(quantity, _)| match *quantity {
        "t" => known == "t",
        quantity => known.starts_with(quantity),
    });
    let mut stems =
        units.flat_map(|(_, units)| units.iter().filter_map(|(ending, _)| bare.strip_suffix(*ending)));
    stems.any(|stem| plain(stem) == plain(&super::column_guess::bare(known)))
}

/// A bare name with this program's words in it, the axis last.
fn plain(bare: &str) -> String {
    if let Some((_, short)) = WHOLE.iter().find(|(long, _)| *long == bare) {
        return (*short).to_owned();
    }
    let first = bare.chars().next().filter(|first| "xyz".contains(*first));
    let turned = first.map(|axis| format!("{}{axis}", &bare[1..])).filter(|turned| part(turned).is_some());
    let bare = turned.as_deref().unwrap_or(bare);
    part(bare).unwrap_or_else(|| bare.to_owned())
}

/// A name whose first part is a word for a sensor, with this program's word instead.
fn part(bare: &str) -> Option<String> {
    let own = ["acc", "gyr", "mag"].map(|own| (own, own));
    let mut words = PARTS.iter().copied().chain(own);
    words.find_map(|(long, short)| Some(format!("{short}{}", bare.strip_prefix(long)?)))
}

#[cfg(test)]
mod tests {
    use super::{super::columns::NAMES, *};

    #[test]
    fn names_of_other_programs_are_guessed() {
        for (found, expected) in [
            ("accx", "acc_x"),
            ("Acc_X", "acc_x"),
            ("ax", "acc_x"),
            ("AccelY", "acc_y"),
            ("x_acc", "acc_x"),
            ("linear_acceleration.z", "acc_z"),
            ("gyro_x", "gyr_x"),
            ("gyr-y", "gyr_y"),
            ("wz", "gyr_z"),
            ("angular_velocity.x", "gyr_x"),
            ("magnetometer_z", "mag_z"),
            ("temperature", "temp"),
            ("time", "t"),
            ("qw", "ref_qw"),
            ("ref_p_x", "ref_px"),
            ("RefPosition.y", "ref_py"),
            ("reff_pz", "ref_pz"),
            ("sim_accx", "sim_acc_x"),
            ("simAccelY", "sim_acc_y"),
            ("simulated_gyro_z", "sim_gyr_z"),
            ("smi_mag_x", "sim_mag_x"),
            ("sim_temperature", "sim_temp"),
            ("gimbal_outter", "gimbal_outer"),
            ("Segment", "segment"),
        ] {
            assert_eq!(meant(found, &NAMES), Some((expected, false)), "{found}");
        }
    }

    #[test]
    fn a_unit_behind_a_name_does_not_hide_it() {
        for (found, expected) in [
            ("temp_c", "temp"),
            ("Temperature [°C]", "temp"),
            ("ax_g", "acc_x"),
            ("acc_x [m/s^2]", "acc_x"),
            ("gyro_z (deg/s)", "gyr_z"),
            ("mag_y_uT", "mag_y"),
            ("time_s", "t"),
            ("timestamp_us", "t"),
            ("gimbal_inner_deg", "gimbal_inner"),
        ] {
            assert_eq!(meant(found, &NAMES), Some((expected, true)), "{found}");
        }
    }

    #[test]
    fn other_quantities_are_left_alone() {
        for name in ["volts", "note", "tc", "pressure", "x", "", "row", "gps_lat"] {
            assert_eq!(meant(name, &NAMES), None, "{name}");
        }
        for name in ["ref_vx", "sim_time", "sim_t", "sim_pos_x", "sim_qw", "similar", "px"] {
            let others: Vec<&'static str> =
                NAMES.into_iter().filter(|name| !name.starts_with("ref_q")).collect();
            assert_eq!(meant(name, &others), None, "{name}");
        }
        // A position whose attitude is not there.
        let attitude = ["ref_qw", "ref_qx", "ref_qy", "ref_qz"];
        assert_eq!(meant("ref_px", &attitude), None);
        assert_eq!(meant("sim_acc_x", &["acc_x", "acc_y"]), None);
        let others: Vec<&'static str> = NAMES.into_iter().filter(|name| !name.starts_with("acc")).collect();
        assert_eq!(meant("acc2_x", &others), None);
    }
}
