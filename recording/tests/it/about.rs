//! What a recording says of its scanners' models comes back as it was written.

use rowscan_protocol::model::AnyModel;
use rowscan_recording::About;

/// Of every pair of models: one stream whose model is known, one that can be either.
#[test]
fn models_and_candidates_of_each_stream_come_back() {
    let names: Vec<&str> = AnyModel::all().map(AnyModel::name).collect();
    for pair in names.windows(2) {
        let [first, second] = pair else { panic!("two") };
        let about = About {
            models: [("left".to_owned(), (*first).to_owned())].into(),
            candidates: [("right".to_owned(), pair.join(", "))].into(),
            ..About::default()
        };
        let read = About::from_entries(&about.entries());
        assert_eq!(read, about);
        assert_eq!(read.candidates_of("left"), [*first]);
        assert_eq!(read.candidates_of("right"), [*first, *second]);
        assert_eq!(read.candidates_of("behind"), Vec::<&str>::new(), "nothing was said of it");
        assert_eq!(read.model_of("right"), None, "one of two is not known");
        // What is known comes before what can be.
        let known = About { model: Some((*second).to_owned()), ..about };
        assert_eq!(known.candidates_of("right"), [*second]);
    }
}
