//! QEMU in place of a board. To end it is to cut the device's power.

use std::{
    fs::{self, OpenOptions},
    io::{self, ErrorKind},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    thread::sleep,
    time::{Duration, Instant},
};

use super::address::Machine;

/// QEMU has connected by then, or never will.
const PATIENCE: Duration = Duration::from_secs(20);
/// Memory that a file stands behind, bytes: all of the machine's PSRAM.
const PSRAM: u64 = 16 << 20;

/// The flash is written in place, so a file that is none must not be given for it.
pub(super) fn check_flash(flash: Option<&Path>) -> io::Result<()> {
    let Some((path, found)) = flash.and_then(|path| Some((path, fs::metadata(path).ok()?))) else {
        return Ok(());
    };
    if found.is_file() && [0, PSRAM].contains(&found.len()) {
        return Ok(());
    }
    let cause = format!(
        "{}: found something else than the flash of an emulated device, expected a file of {PSRAM} bytes, or none",
        path.display()
    );
    Err(io::Error::new(ErrorKind::AlreadyExists, cause))
}

/// A running QEMU; killed when dropped.
pub(super) struct Qemu(Child);

impl Qemu {
    /// Starts an image; `flash` is the file that keeps its flash (not on the micro:bit, whose flash QEMU
    /// keeps in no file).
    pub(super) fn start(
        machine: Machine,
        image: &Path,
        flash: Option<&Path>,
    ) -> io::Result<(Self, TcpStream)> {
        if !image.is_file() {
            return Err(io::Error::new(ErrorKind::NotFound, format!("no image {}", image.display())));
        }
        // The host listens, so that there is no race for a port.
        let listener = TcpListener::bind(("127.0.0.1", 0))?;
        listener.set_nonblocking(true)?;
        let mut command = Command::new("qemu-system-arm");
        let mut board = machine.name().to_owned();
        if let Some(flash) = flash.filter(|_| machine != Machine::Microbit) {
            let file = OpenOptions::new().create(true).truncate(false).write(true).open(flash)?;
            file.set_len(PSRAM)?;
            let backend = format!("memory-backend-file,id=nv,size=16M,mem-path={},share=on", flash.display());
            command.args(["-object", &backend]);
            board.push_str(",memory-backend=nv");
        }
        let child = command
            .args(["-machine", &board, "-display", "none", "-monitor", "none"])
            .args(["-serial", &format!("tcp:{},nodelay=on", listener.local_addr()?)])
            .arg("-kernel")
            .arg(image)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()?;
        let mut qemu = Self(child);
        let stream = qemu.connected(&listener)?;
        stream.set_nonblocking(false)?;
        Ok((qemu, stream))
    }

    fn connected(&mut self, listener: &TcpListener) -> io::Result<TcpStream> {
        let end = Instant::now() + PATIENCE;
        loop {
            match listener.accept() {
                Ok((stream, _)) => return Ok(stream),
                Err(cause) if cause.kind() != ErrorKind::WouldBlock => return Err(cause),
                Err(_) => {}
            }
            if let Some(status) = self.0.try_wait()? {
                let said = self.0.stderr.take().map(io::read_to_string).transpose()?.unwrap_or_default();
                return Err(io::Error::other(format!("QEMU ended with {status}: {}", said.trim())));
            }
            if Instant::now() > end {
                return Err(ErrorKind::TimedOut.into());
            }
            sleep(Duration::from_millis(5));
        }
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        // It may have ended by itself; either way nothing is left to do.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_flash_is_not_taken_for_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.csv");
        assert!(check_flash(None).is_ok() && check_flash(Some(&path)).is_ok());
        fs::write(&path, "").unwrap();
        assert!(check_flash(Some(&path)).is_ok());
        fs::write(&path, "t,acc_x,acc_y,acc_z\n").unwrap();
        let message = check_flash(Some(&path)).unwrap_err().to_string();
        assert!(message.contains("run.csv: found something else than the flash"), "{message}");
        assert!(check_flash(Some(folder.path())).is_err());
        OpenOptions::new().write(true).open(&path).unwrap().set_len(PSRAM).unwrap();
        assert!(check_flash(Some(&path)).is_ok());
    }
}
