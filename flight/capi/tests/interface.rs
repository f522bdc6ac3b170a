//! What C may do wrong is an error, and no crash.

use starpipe::*;
use std::ffi::CStr;
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

#[test]
fn null_pointers_are_told() {
    let mut bytes = 0;
    let mut v_mag = 0.0;
    let budget = MaybeUninit::uninit();
    // SAFETY: each pointer is null or points to a value.
    let codes = unsafe {
        [
            starpipe_size(null(), null(), 0, &raw mut bytes),
            starpipe_init(null_mut(), 0, null(), null(), 0, null_mut()),
            starpipe_detect(null_mut(), null(), null_mut(), 0, null_mut()),
            starpipe_lost(null_mut(), null(), 0, null(), null(), null_mut()),
            starpipe_start(null_mut(), null(), 0.0),
            starpipe_track(null_mut(), null(), 0.0, null(), null_mut()),
            starpipe_limit(null(), &raw mut v_mag),
            starpipe_work(null(), budget.as_ptr(), null_mut(), null_mut()),
        ]
    };
    assert_eq!(codes, [STARPIPE_NULL; 8]);
}

#[test]
fn every_code_has_its_words() {
    let words = |code| {
        // SAFETY: the texts are constants.
        unsafe { CStr::from_ptr(starpipe_error_text(code)) }
            .to_str()
            .unwrap()
    };
    let mut all: Vec<&str> = (STARPIPE_OK..=STARPIPE_FAULT + 1).map(words).collect();
    assert_eq!(all.last(), Some(&"this is no error"));
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len() as i32, STARPIPE_FAULT + 2);
    // SAFETY: the same.
    let version = unsafe { CStr::from_ptr(starpipe_version()) };
    assert_eq!(version.to_str().unwrap(), env!("CARGO_PKG_VERSION"));
}

#[test]
fn a_catalog_that_is_none_is_told() {
    let config = MaybeUninit::zeroed();
    let mut bytes = 0;
    let catalog = [0_u8; 100];
    // SAFETY: zeros are a configuration, though not one that is of use.
    let code = unsafe {
        starpipe_size(
            config.as_ptr(),
            catalog.as_ptr(),
            catalog.len(),
            &raw mut bytes,
        )
    };
    assert_eq!(code, STARPIPE_CATALOG);
}
