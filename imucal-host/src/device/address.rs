//! Where a device is.

use std::{fmt, path::PathBuf, str::FromStr};

/// Where a device is: `serial:PATH[@BAUD]`, `tcp:HOST:PORT`, `qemu[:IMAGE]`, `an505[:IMAGE]` or
/// `microbit[:IMAGE]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// A serial port and its speed, baud.
    Serial(String, u32),
    /// A TCP port.
    Tcp(String),
    /// QEMU, which is started and ended with the session.
    Qemu(Machine, PathBuf),
}

/// A machine of QEMU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Machine {
    /// mps2-an386, a Cortex-M4F.
    Mps2,
    /// mps2-an505, a Cortex-M33.
    An505,
    /// micro:bit, a Cortex-M0.
    Microbit,
}

/// No address of a device.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "found `{0}`, expected `serial:PATH[@BAUD]`, `tcp:HOST:PORT`, `qemu[:IMAGE]`, `an505[:IMAGE]` or `microbit[:IMAGE]`"
)]
pub struct AddressError(String);

/// Speed of a serial port, unless another is named.
const BAUD: u32 = 115_200;

impl Machine {
    /// QEMU's name for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mps2 => "mps2-an386",
            Self::An505 => "mps2-an505",
            Self::Microbit => "microbit",
        }
    }

    /// Where cargo puts its image.
    fn image(self) -> PathBuf {
        let target = match self {
            Self::Mps2 => "thumbv7em-none-eabihf",
            Self::An505 => "thumbv8m.main-none-eabihf",
            Self::Microbit => "thumbv6m-none-eabi",
        };
        ["target", target, "firmware", "coprocessor"].iter().collect()
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let wrong = || AddressError(text.into());
        let (kind, rest) = text.split_once(':').unwrap_or((text, ""));
        let qemu = |machine: Machine| {
            Self::Qemu(machine, if rest.is_empty() { machine.image() } else { rest.into() })
        };
        match kind {
            "serial" => {
                let (path, baud) = match rest.rsplit_once('@') {
                    Some((path, baud)) => (path, baud.parse().map_err(|_| wrong())?),
                    None => (rest, BAUD),
                };
                if path.is_empty() { Err(wrong()) } else { Ok(Self::Serial(path.into(), baud)) }
            }
            "tcp" if rest.contains(':') => Ok(Self::Tcp(rest.into())),
            "qemu" => Ok(qemu(Machine::Mps2)),
            "an505" => Ok(qemu(Machine::An505)),
            "microbit" => Ok(qemu(Machine::Microbit)),
            _ => Err(wrong()),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial(path, _) => write!(f, "serial:{path}"),
            Self::Tcp(place) => write!(f, "tcp:{place}"),
            Self::Qemu(machine, _) => write!(f, "qemu {}", machine.name()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_as_they_are_documented() {
        let read = |text: &str| text.parse::<Address>();
        assert_eq!(read("serial:/dev/ttyACM0"), Ok(Address::Serial("/dev/ttyACM0".into(), BAUD)));
        assert_eq!(read("serial:COM3@9600"), Ok(Address::Serial("COM3".into(), 9600)));
        assert_eq!(read("tcp:localhost:3333"), Ok(Address::Tcp("localhost:3333".into())));
        assert_eq!(read("qemu:a.elf"), Ok(Address::Qemu(Machine::Mps2, "a.elf".into())));
        assert_eq!(read("microbit"), Ok(Address::Qemu(Machine::Microbit, Machine::Microbit.image())));
        assert_eq!(read("an505"), Ok(Address::Qemu(Machine::An505, Machine::An505.image())));
        for wrong in ["", "usb", "serial:", "tcp:localhost", "serial:COM3@fast"] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
