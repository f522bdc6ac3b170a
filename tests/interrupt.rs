//! A frame's work can be ended early wherever it is, and the buffers serve the next frame.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on should stop")]

mod common;

use common::fixture;
use starpipe::detect::DetectError;
use starpipe::identify::IndexedCatalog;
use starpipe::pipeline::{Outcome, Workspace, solve_frame};
use starpipe::{Context, Interrupt, frame};
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

#[test]
fn a_frame_is_ended_wherever_it_is_and_the_buffers_serve_the_next() {
    let indexed = IndexedCatalog::built_in();
    let context = Context::new(&indexed);
    let frame = frame::read(fixture("cygnus/cygnus.tif")).unwrap();
    let (never, asked) = at_question(usize::MAX);
    let mut workspace = Workspace::new().until(&never);
    let expected = solve_frame(&frame, &context, &mut workspace).unwrap();
    let questions = asked.load(Ordering::Relaxed);
    assert!(questions > 30, "asked {questions} times");

    let (mut in_detection, mut in_search) = (0, 0);
    // The search asks last.
    for number in (1..questions)
        .step_by(questions / 20)
        .chain([questions - 1, questions])
    {
        let (interrupt, asked) = at_question(number);
        workspace = workspace.until(&interrupt);
        match solve_frame(&frame, &context, &mut workspace) {
            Err(DetectError::Interrupted(_)) => in_detection += 1,
            Err(other) => panic!("{other}"),
            Ok(solution) => match solution.outcome {
                Outcome::NotIdentified(reason) if reason.code() == "interrupted" => in_search += 1,
                // The stars were found already.
                outcome => assert_eq!(outcome, expected.outcome, "at question {number}"),
            },
        }
        let asked = asked.load(Ordering::Relaxed);
        assert!(asked < number + 10, "{number} became {asked}");

        workspace = workspace.until(&Interrupt::default());
        let next = solve_frame(&frame, &context, &mut workspace).unwrap();
        assert_eq!(next.outcome, expected.outcome, "after question {number}");
        assert_eq!(next.sources, expected.sources, "after question {number}");
    }
    assert!(
        in_detection > 0 && in_search > 0,
        "{in_detection} {in_search}"
    );
}
