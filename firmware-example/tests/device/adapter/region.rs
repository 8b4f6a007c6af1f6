//! A region of a larger flash.

use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash};
use firmware_example::adapter::region::{Region, RegionError};

use super::{answers_in_peace, answers_of, requests};
use crate::{
    bench::Wire,
    nor::{Nor, PAGE},
};

const LENGTH: u32 = 2 * PAGE as u32;

#[test]
fn a_device_keeps_its_record_in_the_region_and_touches_nothing_else() {
    let requests = requests();
    for page in 0..=4 {
        let mut flash = Nor::new(6);
        flash.bytes.fill(0x5A);
        let start = page * PAGE;
        flash.bytes[start..start + 2 * PAGE].fill(0xFF);
        let region = Region::new(flash, start as u32, LENGTH).expect("it is inside");
        let wire = Wire::default();
        let (answers, mut region) = answers_of(wire.clone(), region, &wire, &requests);
        assert_eq!(answers, answers_in_peace(&requests), "page {page}");
        let mut kept = vec![0; 2 * PAGE];
        region.read(0, &mut kept).expect("inside");
        let flash = region.into_inner();
        assert!(kept == flash.bytes[start..start + 2 * PAGE] && kept.iter().any(|byte| *byte != 0xFF));
        let others = flash.bytes[..start].iter().chain(&flash.bytes[start + 2 * PAGE..]);
        assert!(others.into_iter().all(|byte| *byte == 0x5A), "page {page}");
    }
}

#[test]
fn what_lies_outside_or_across_a_page_is_no_region() {
    let page = PAGE as u32;
    let wrong =
        [(0, 0), (1, page), (0, page + 4), (5 * page, LENGTH), (7 * page, page), (page, u32::MAX - page + 1)];
    for (start, length) in wrong {
        let refused = Region::new(Nor::new(6), start, length);
        assert!(matches!(refused, Err(RegionError::Bounds)), "{start:#x}, {length:#x}");
    }
}

#[test]
fn an_access_beyond_the_region_is_refused() {
    let mut region = Region::new(Nor::new(6), PAGE as u32, LENGTH).expect("it is inside");
    assert_eq!(region.capacity(), LENGTH as usize);
    let outside = Err(RegionError::Access(NorFlashErrorKind::OutOfBounds));
    assert_eq!(region.read(LENGTH - 4, &mut [0; 8]), outside);
    assert_eq!(region.write(LENGTH, &[0; 4]), outside);
    assert_eq!(region.erase(0, LENGTH + PAGE as u32), outside);
    assert_eq!(region.write(1, &[0; 4]), Err(RegionError::Access(NorFlashErrorKind::NotAligned)));
    assert!(region.into_inner().bytes.iter().all(|byte| *byte == 0xFF));
}
