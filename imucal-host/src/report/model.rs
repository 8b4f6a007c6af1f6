//! What a model's name stands for, in one line: where a name is printed first.

/// In words; `None` for a name that is no model of this program.
pub fn described(name: &str) -> Option<&'static str> {
    Some(match name {
        "T6" => "6 parameters, scale and bias of each axis; from rests on six faces",
        "T9" => "9 parameters, upper triangular gain and bias; calibrated rests have the length of gravity",
        "T12" => "12 parameters, gain and bias; from the attitudes of a rig whose base is taken as level",
        "I14" => "14 parameters, gain, bias and two tilts of the rig's base; from the rig's attitudes",
        "I17" => "17 parameters, I14 and three quadratic terms",
        "I20" => "20 parameters, I17 and three cubic terms",
        "I23" => "23 parameters, I20 and three products of two axes",
        "K9" => "9 parameters, gain; from turns between rests, the bias from the rests themselves",
        "K12" => "12 parameters, gain and bias; from turns between rests",
        "G12" => "12 parameters, gain and bias; the integrated rate agrees with known attitudes",
        "G21" => "21 parameters, G12 and nine terms of g-sensitivity",
        "E9" => "9 parameters, an ellipsoid: gain and bias; calibrated samples have one length",
        "M12" => "12 parameters, gain and bias; from known attitudes in a known field",
        "M15" => "15 parameters, M12 and the field",
        "X18" => "18 parameters, M12 and hard iron on two gimbals of the rig",
        "X21" => "21 parameters, X18 and the field",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::{acc::rests::AccModel, gyr, known_attitudes::ladder, mag};

    #[test]
    fn every_model_that_is_fitted_is_described_with_its_size() {
        let ladders = [&ladder::ACCELEROMETER[..], &ladder::MAGNETOMETER, &gyr::rig::MODELS].concat();
        let field = [AccModel::T6.name(), AccModel::T9.name(), gyr::turns::MODEL, mag::samples::MODEL];
        for name in ladders.iter().map(|(name, _)| *name).chain(field) {
            let size = described(name).and_then(|words| words.split_once(" parameters"));
            assert_eq!(size.map(|(size, _)| size), Some(&name[1..]), "{name}");
        }
        assert_eq!(described("Z9"), None);
    }
}
