//! The page that plays recordings: one file that needs no network.

use super::Header;
use crate::lab::picture::svg::escaped;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// Largest number of recordings on a page.
pub const MOST: usize = 4;

/// Style sheet of the player.
pub const STYLE: &str = include_str!("replay.css");
/// Script of the player: what draws a frame, then what plays recordings with it.
pub const SCRIPT: &str = concat!(include_str!("draw.js"), include_str!("replay.js"));

/// A recording on a page.
pub struct RecordingPanel {
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// Description of the run.
    pub header: Header,
    /// CSS color of its curves.
    pub color: String,
}

/// The player as a part of a page that includes [`STYLE`] and [`SCRIPT`]. Without JavaScript only the
/// captions are shown.
///
/// Playback starts at the fraction `share`, in [0, 1], of the time.
pub fn fragment(panels: &[RecordingPanel], share: f64) -> String {
    let mut text = format!("<div class=\"replay\" data-start=\"{share}\">\n<div class=\"panels\">\n");
    for RecordingPanel { bytes, header, color } in panels {
        let outcome = if header.outcome == "holds" { "holds" } else { "broken" };
        text += &format!(
            "<figure style=\"--own: {}\"><figcaption><b>{}</b> · {} · {} <span class=\"{outcome}\">{}</span>\
             </figcaption>\n<canvas class=\"scene\"></canvas><canvas class=\"curves\"></canvas>\n\
             <script type=\"application/octet-stream\">{}</script></figure>\n",
            escaped(color),
            escaped(&header.solver),
            escaped(&header.scene),
            escaped(&header.setting),
            escaped(&header.outcome),
            STANDARD.encode(bytes)
        );
    }
    text + "</div>\n<noscript><p>The replay needs JavaScript.</p></noscript>\n</div>\n"
}

/// A complete page with the player.
pub fn page(panels: &[RecordingPanel]) -> String {
    let mut scenes: Vec<&str> = panels.iter().map(|p| p.header.scene.as_str()).collect();
    scenes.dedup();
    let title = format!("Replay: {}", escaped(&scenes.join(", ")));
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <style>body {{ margin: 1rem; font: 15px/1.45 system-ui, sans-serif; color: #1f2933; }}\n\
         h1 {{ font-size: 1.3rem; margin: 0 0 .5rem; }}\n\
         @media (prefers-color-scheme: dark) {{ body {{ color: #e4e7eb; background: #14181d; }} }}\n{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n{}\
         <script>\n{SCRIPT}</script>\n</body>\n</html>\n",
        fragment(panels, 0.0)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::recording::ShapeRecord;

    #[test]
    fn names_stay_text_and_nothing_is_loaded() {
        let header = Header {
            scene: "<script>".into(),
            solver: "a&b".into(),
            setting: "\"x\"".into(),
            outcome: "fell at step 3".into(),
            dt: 0.1,
            every: 1,
            units: [0.1; 3],
            kinds: "s".into(),
            shapes: vec![ShapeRecord { body: 0, points: vec![[0.0; 2]], radius: 1.0 }],
            joints: Vec::new(),
            contacts: false,
            curves: Vec::new(),
        };
        let text = page(&[RecordingPanel { bytes: b"1234".to_vec(), header, color: "#123456".into() }]);
        assert!(text.contains("&lt;script&gt;") && text.contains("a&amp;b") && text.contains("MTIzNA=="));
        assert!(text.contains("class=\"broken\">fell at step 3"));
        for outside in ["http://", "https://", "src=", "@import"] {
            assert!(!text.contains(outside), "{outside}");
        }
    }
}
