//! A frame's work can be ended early wherever it is, and the buffers serve the next frame.

use crate::common::fixture;
use starpipe::frame::{Buffers, FrameError};
use starpipe::identify::IndexedCatalog;
use starpipe::solve::{Outcome, Workspace, solve_frame};
use starpipe::{Context, Frame, Interrupt, frame};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Is due when it is asked for the `number`th time, and counts how often it is asked.
fn at_question(number: usize) -> (Interrupt, Arc<AtomicUsize>) {
    let asked = Arc::new(AtomicUsize::new(0));
    let interrupt = Interrupt::when({
        let asked = Arc::clone(&asked);
        move || asked.fetch_add(1, Ordering::Relaxed) + 1 >= number
    });
    (interrupt, asked)
}

/// A small frame of whose inexact triangles each resembles very many of the catalogue's.
fn few_triangles() -> Frame<'static> {
    let spots = b"L]name\x16^\"m\x80\xff\xa5>/j\xe98D\x95\xe0L]\x16^\"m~\xd3R7\xc2$\x8f\x1d";
    let first = [0xff, 0xa5, 0x3e, 0x2f, 0x6a, 0xe9, 0x38, 0x44, 0x95, 0xe0];
    let values = [&first[..], &[0; 89], spots].concat();
    let pixels: Vec<u8> = values.into_iter().cycle().take(200 * 49).collect();
    Frame::from_samples(200, 49, &pixels[..])
        .unwrap()
        .into_owned()
}

#[test]
fn a_search_of_few_triangles_is_asked_often_too() {
    let indexed = IndexedCatalog::built_in();
    let context = Context::new(&indexed);
    let frame = few_triangles();
    let (interrupt, asked) = at_question(200);
    let mut workspace = Workspace::new().with_interrupt(&interrupt);
    let solution = solve_frame(&frame, &context, &mut workspace).unwrap();
    match solution.outcome {
        Outcome::NotIdentified(reason) => assert_eq!(reason.code(), "interrupted"),
        outcome => panic!("{outcome:?}"),
    }
    assert!(asked.load(Ordering::Relaxed) < 210);
}

#[test]
fn a_frame_is_ended_wherever_it_is_and_the_buffers_serve_the_next() {
    let indexed = IndexedCatalog::built_in();
    let context = Context::new(&indexed);
    let frame = frame::read(fixture("cygnus/cygnus.tif")).unwrap();
    let (never, asked) = at_question(usize::MAX);
    let mut workspace = Workspace::new().with_interrupt(&never);
    let expected = solve_frame(&frame, &context, &mut workspace).unwrap();
    let questions = asked.load(Ordering::Relaxed);
    assert!(questions > 30, "asked {questions} times");

    let (mut in_detection, mut in_search) = (0, 0);
    // The search asks last, of a frame whose stars are detected.
    for number in (1..questions)
        .step_by(questions / 20)
        .chain([questions - 1, questions])
    {
        let (interrupt, asked) = at_question(number);
        workspace = workspace.with_interrupt(&interrupt);
        let solution = solve_frame(&frame, &context, &mut workspace).unwrap();
        match solution.outcome {
            Outcome::NotIdentified(reason) if reason.code() == "interrupted" => {
                in_detection += usize::from(solution.sources.is_empty());
                in_search += usize::from(!solution.sources.is_empty());
            }
            // The stars were found already.
            outcome => assert_eq!(outcome, expected.outcome, "at question {number}"),
        }
        let asked = asked.load(Ordering::Relaxed);
        assert!(asked < number + 10, "{number} became {asked}");

        workspace = workspace.with_interrupt(&Interrupt::default());
        let next = solve_frame(&frame, &context, &mut workspace).unwrap();
        assert_eq!(next.outcome, expected.outcome, "after question {number}");
        assert_eq!(next.sources, expected.sources, "after question {number}");
    }
    assert!(
        in_detection > 0 && in_search > 0,
        "{in_detection} {in_search}"
    );
}

#[test]
fn reading_is_ended_wherever_it_is_and_the_buffers_serve_the_next() {
    let files = ["orion/orion.png", "cygnus/cygnus.tif"];
    for name in files {
        let path = fixture(name);
        let mut buffers = Buffers::new();
        let (never, asked) = at_question(usize::MAX);
        buffers.set_interrupt(never);
        let expected = frame::read_page_with(&path, None, &mut buffers).unwrap();
        let questions = asked.load(Ordering::Relaxed);
        assert!(questions > 3, "{name}: asked {questions} times");
        for number in (1..=questions).step_by(questions.div_ceil(10)) {
            let (interrupt, _) = at_question(number);
            buffers.set_interrupt(interrupt);
            let error = frame::read_page_with(&path, None, &mut buffers).unwrap_err();
            let FrameError::File { source, .. } = &error else {
                panic!("{error}");
            };
            assert!(
                matches!(**source, FrameError::Interrupted(_)),
                "{name}: {error}"
            );
        }
        buffers.set_interrupt(Interrupt::default());
        assert_eq!(
            frame::read_page_with(&path, None, &mut buffers).unwrap(),
            expected
        );
    }
}
