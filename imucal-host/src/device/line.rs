//! Bytes to and from a device.

use std::{
    io::{self, Read, Write},
    net::TcpStream,
    path::Path,
    time::Duration,
};

use super::{
    Address, DeviceError,
    qemu::{self, Qemu},
};

/// A read gives up after this, so that whoever waits can look at the clock.
const READ_PATIENCE: Duration = Duration::from_millis(50);

/// What to do about a serial port that cannot be opened.
const SERIAL_ADVICE: &str = if cfg!(feature = "serial") {
    "check the port's name and who else has it open"
} else {
    "build with `--features serial`, or give a `tcp:` address"
};

/// An open line.
pub(super) enum Line {
    #[cfg(feature = "serial")]
    Serial(Box<dyn serialport::SerialPort>),
    /// With the QEMU at its other end, which lives as long.
    Tcp(TcpStream, #[expect(dead_code, reason = "held for its end")] Option<Qemu>),
}

impl Line {
    /// Opens a line; `flash` is the file behind an emulated device's flash.
    pub(super) fn open(address: &Address, flash: Option<&Path>) -> Result<Self, DeviceError> {
        let unreachable = |cause: io::Error, advice| DeviceError::Unreachable {
            address: address.to_string(),
            cause,
            advice,
        };
        match address {
            Address::Serial(path, baud) => {
                Self::serial(path, *baud).map_err(|cause| unreachable(cause, SERIAL_ADVICE))
            }
            Address::Tcp(place) => TcpStream::connect(place)
                .and_then(prepare)
                .map(|stream| Self::Tcp(stream, None))
                .map_err(|cause| unreachable(cause, "check host, port and that something listens there")),
            Address::Qemu(machine, image) => {
                qemu::check_flash(flash)
                    .map_err(|cause| unreachable(cause, "choose another --flash; nothing was changed"))?;
                Qemu::start(*machine, image, flash)
                    .and_then(|(qemu, stream)| Ok(Self::Tcp(prepare(stream)?, Some(qemu))))
                    .map_err(|cause| {
                        unreachable(
                            cause,
                            "build the image (see imucal-host/docs/devices.md) and install qemu-system-arm",
                        )
                    })
            }
        }
    }

    #[cfg(feature = "serial")]
    fn serial(path: &str, baud: u32) -> io::Result<Self> {
        Ok(Self::Serial(serialport::new(path, baud).timeout(READ_PATIENCE).open()?))
    }

    #[cfg(not(feature = "serial"))]
    fn serial(_: &str, _: u32) -> io::Result<Self> {
        Err(io::Error::new(io::ErrorKind::Unsupported, "this build is without serial ports"))
    }

    /// What has come, if anything has; nothing after a while.
    pub(super) fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let read = match self {
            #[cfg(feature = "serial")]
            Self::Serial(port) => port.read(bytes),
            Self::Tcp(stream, _) => match stream.read(bytes) {
                Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
                read => read,
            },
        };
        match read {
            Err(cause) if matches!(cause.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock) => {
                Ok(0)
            }
            read => read,
        }
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        match self {
            #[cfg(feature = "serial")]
            Self::Serial(port) => port.write_all(bytes).and_then(|()| port.flush()),
            Self::Tcp(stream, _) => stream.write_all(bytes),
        }
    }
}

fn prepare(stream: TcpStream) -> io::Result<TcpStream> {
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(READ_PATIENCE))?;
    Ok(stream)
}
