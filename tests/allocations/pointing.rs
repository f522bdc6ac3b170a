//! The pointing alone allocates nothing from the second frame of a size on.

use starpipe::{Catalog, Context, IndexedCatalog, Workspace, find_pointing_in, frame};

#[test]
fn the_pointing_of_a_frame_allocates_nothing_in_steady_state() {
    let indexed = IndexedCatalog::build(Catalog::built_in(), &|_| ());
    let context = Context::new(&indexed);
    let mut workspace = Workspace::new();
    let names = ["orion/orion.png", "cygnus/cygnus.tif"];
    let directory = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures");
    let frames = names.map(|name| frame::read(directory.join(name)).unwrap());
    let mut find = |number: usize| {
        let found = find_pointing_in(&frames[number], &context, &mut workspace).unwrap();
        found.map(|found| found.matches.len())
    };
    let first = [0, 1].map(&mut find);
    assert!(
        first
            .iter()
            .all(|stars| stars.is_some_and(|stars| stars > 20))
    );
    for (number, expected) in first.into_iter().enumerate() {
        let mut again = None;
        let steady = allocation_counter::measure(|| again = find(number));
        assert_eq!(
            (again, steady.count_total),
            (expected, 0),
            "{}",
            names[number]
        );
    }
}
