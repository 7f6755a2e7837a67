//! Any text as a page's message: a refusal, or a command. A gesture is done and taken back, to the same mesh.
#![no_main]

use std::cell::RefCell;

use atomesh::watch::Silent;
use atomesh_job::options::RunConfig;
use atomesh_studio::Session;
use atomesh_studio::log::Source;
use atomesh_studio::protocol::{Command, Numbered};
use libfuzzer_sys::fuzz_target;

/// A session on a small image.
struct Open {
    session: Session,
    _folder: tempfile::TempDir,
}

impl Open {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut session = Session::open(folder.path(), &mut Silent).unwrap();
        let run = RunConfig::parse("[lattice]\nsize = 60.0").unwrap();
        let source = Source::Scene { name: "disc".into(), seed: 0 };
        session.open_image(source, run, &mut Silent).unwrap();
        Self { session, _folder: folder }
    }
}

thread_local! {
    static OPEN: RefCell<Open> = RefCell::new(Open::new());
}

/// Whether a gesture may ask for more work than a second's.
fn is_long(text: &str) -> bool {
    // sizes, scales and limits of any number; what is left is still all kinds of gestures
    text.contains("\"set\"")
}

fuzz_target!(|text: &str| {
    let Ok(numbered) = Numbered::parse(text) else { return };
    let Command::Do { gesture } = numbered.command else { return };
    if is_long(text) {
        return;
    }
    OPEN.with_borrow_mut(|open| {
        let before = open.session.counts();
        if open.session.act(gesture, &mut Silent).is_ok() {
            open.session.undo(&mut Silent).expect("what was done is taken back");
            assert_eq!(open.session.counts()[0], before[0]);
        } else {
            assert_eq!(open.session.counts(), before, "what is refused is not done");
        }
    });
});
