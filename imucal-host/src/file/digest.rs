//! SHA-256 of files: by which a result is known to come from one.

use std::{
    fs::File,
    io::{self, Read},
    path::Path,
};

use sha2::{Digest, Sha256};

/// The length in bytes of files, one behind the other, and their SHA-256 in hexadecimal digits.
///
/// # Errors
///
/// What the system says of a file that cannot be read.
pub fn sha256<P: AsRef<Path>>(files: &[P]) -> io::Result<(u64, String)> {
    let mut hash = Sha256::new();
    let mut buffer = vec![0; 1 << 16];
    let mut bytes = 0;
    for path in files {
        let mut file = File::open(path)?;
        loop {
            let read = file.read(&mut buffer)?;
            if read == 0 {
                break;
            }
            hash.update(&buffer[..read]);
            bytes += read as u64;
        }
    }
    Ok((bytes, hexadecimal(&hash.finalize())))
}

/// SHA-256 of what a file is to hold, in hexadecimal digits.
#[must_use]
pub fn sha256_of(content: &[u8]) -> String {
    hexadecimal(&Sha256::digest(content))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_and_its_content_have_the_digest_of_the_standard() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("abc");
        std::fs::write(&path, "abc").unwrap();
        // FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(&[&path]).unwrap(), (3, expected.to_owned()));
        let parts = ["a", "bc"].map(|part| folder.path().join(part));
        parts
            .iter()
            .for_each(|part| std::fs::write(part, part.file_name().unwrap().as_encoded_bytes()).unwrap());
        assert_eq!(sha256(&parts).unwrap(), (3, expected.to_owned()));
        assert_eq!(sha256_of(b"abc"), expected);
    }
}
