//! The page itself: files that are part of the program. It fetches nothing from anywhere else, and is told not to.

use axum::Router;
use axum::http::HeaderName;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_SECURITY_POLICY, CONTENT_TYPE, REFERRER_POLICY, X_CONTENT_TYPE_OPTIONS,
};
use axum::response::IntoResponse;
use axum::routing::get;

/// What the page may do: run its own scripts, show its own styles, ask its own server.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const HTML: &str = "text/html; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const IMAGE: &str = "image/svg+xml";

/// A file of the page: its path, its type, what it holds.
struct File(&'static str, &'static str, &'static str);

/// Every file. A new one is a line here.
const FILES: &[File] = &[
    File("/", HTML, include_str!("../page/index.html")),
    File("/page/style.css", STYLE, include_str!("../page/style.css")),
    File("/page/icon.svg", IMAGE, include_str!("../page/icon.svg")),
    File("/page/main.js", SCRIPT, include_str!("../page/main.js")),
    File("/page/link.js", SCRIPT, include_str!("../page/link.js")),
    File("/page/decode.js", SCRIPT, include_str!("../page/decode.js")),
    File("/page/colour.js", SCRIPT, include_str!("../page/colour.js")),
    File("/page/fan.js", SCRIPT, include_str!("../page/fan.js")),
    File("/page/matrix.js", SCRIPT, include_str!("../page/matrix.js")),
    File("/page/camera.js", SCRIPT, include_str!("../page/camera.js")),
    File("/page/crowns.js", SCRIPT, include_str!("../page/crowns.js")),
    File("/page/shaders.js", SCRIPT, include_str!("../page/shaders.js")),
    File("/page/solids.js", SCRIPT, include_str!("../page/solids.js")),
    File("/page/world.js", SCRIPT, include_str!("../page/world.js")),
    File("/page/numbers.js", SCRIPT, include_str!("../page/numbers.js")),
    File("/page/faults.js", SCRIPT, include_str!("../page/faults.js")),
    File("/page/strip.js", SCRIPT, include_str!("../page/strip.js")),
    File("/page/timeline.js", SCRIPT, include_str!("../page/timeline.js")),
];

/// The page's routes.
pub(crate) fn routes() -> Router {
    FILES.iter().fold(Router::new(), |routes, file| routes.route(file.0, get(async || file.answer())))
}

impl File {
    fn answer(&self) -> impl IntoResponse + use<> {
        let Self(_, kind, text) = *self;
        let headers: [(HeaderName, &str); 5] = [
            (CONTENT_TYPE, kind),
            (CONTENT_SECURITY_POLICY, POLICY),
            (X_CONTENT_TYPE_OPTIONS, "nosniff"),
            (REFERRER_POLICY, "no-referrer"),
            // Another version may answer at the same address tomorrow.
            (CACHE_CONTROL, "no-cache"),
        ];
        (headers, text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_names_no_other_site_and_is_light() {
        let mut bytes = 0;
        for File(path, _, text) in FILES {
            bytes += text.len();
            // A namespace is a name and no address.
            let text = text.replace("http://www.w3.org/2000/svg", "");
            for foreign in ["http://", "https://", "//cdn", "@import", "eval(", "innerHTML"] {
                assert!(!text.contains(foreign), "{path} holds {foreign}");
            }
        }
        assert!(bytes < 500_000, "{bytes} bytes");
    }

    #[test]
    fn every_module_that_is_imported_is_served() {
        for File(path, _, text) in FILES.iter().filter(|file| file.1 == SCRIPT) {
            for rest in text.split(" from \"./").skip(1) {
                let name = rest.split('"').next().unwrap_or_default();
                let served = FILES.iter().any(|file| file.0.strip_prefix("/page/") == Some(name));
                assert!(served, "{path} imports {name}");
            }
        }
    }
}
