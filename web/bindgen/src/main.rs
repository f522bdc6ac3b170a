//! Makes the module of JavaScript from the compiled crate, as `wasm-bindgen --target web` does:
//! `starpipe-web-bindgen FILE.wasm DIRECTORY`.

use std::env;
use std::error::Error;
use wasm_bindgen_cli_support::Bindgen;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = env::args().skip(1).collect();
    let [wasm, directory] = &words[..] else {
        return Err("expected FILE.wasm DIRECTORY".into());
    };
    Bindgen::new()
        .input_path(wasm)
        .web(true)?
        .typescript(false)
        .remove_name_section(true)
        .remove_producers_section(true)
        .out_name("starpipe")
        .generate(directory)?;
    Ok(())
}
