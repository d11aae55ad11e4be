//! A real browser without a window: Chromium, if installed.
//!
//! A page is copied with a script in front that records every error, and a script behind it that operates the
//! page's controls and leaves its findings in the document.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Path of Chromium: the variable `CHROMIUM`, or one of its usual names on the path.
fn find() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("CHROMIUM") {
        return Some(given.into());
    }
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    names.iter().find_map(|name| folders.iter().map(|f| f.join(name)).find(|p| p.is_file()))
}

/// The browser, or `None` and a printed line that states why a test is skipped.
pub fn or_skip(test: &str) -> Option<PathBuf> {
    let found = find();
    if found.is_none() {
        eprintln!("SKIPPED {test}: no Chromium on the path; install the package chromium to run it");
    }
    found
}

fn browse(browser: &Path, folder: &Path, url: &str, options: &[&str]) -> Output {
    let profile = format!("--user-data-dir={}", folder.join("profile").display());
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--hide-scrollbars"])
        .args(["--no-first-run", "--disable-extensions", "--virtual-time-budget=20000", &profile])
        .args(options)
        .arg(url)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    output
}

fn url(path: &Path, fragment: &str) -> String {
    format!("file://{}#{fragment}", path.display())
}

/// Loads a copy of `page`, waits until its replays are ready, and runs the body of an async function that
/// returns an object. Returns that object, with the errors of the page under `errors`.
pub fn drive(browser: &Path, page: &Path, fragment: &str, script: &str) -> serde_json::Value {
    let folder = tempfile::tempdir().unwrap();
    let before = "<script>window.faults = []; addEventListener('error', (e) => faults.push(String(e.message)));
        addEventListener('unhandledrejection', (e) => faults.push(String(e.reason)));
        for (const level of ['error', 'warn']) console[level] = (...all) => faults.push(all.join(' '));</script>";
    let after = format!(
        "<script>addEventListener('load', async () => {{
            const pause = (ms) => new Promise((done) => setTimeout(done, ms));
            for (let i = 0; i < 100 && document.querySelector('.replay:not([data-ready])'); i++) await pause(50);
            let found;
            try {{ found = await (async () => {{ {script} }})(); }} catch (e) {{ found = {{ thrown: String(e) }}; }}
            const pre = document.createElement('pre');
            pre.id = 'found';
            pre.textContent = JSON.stringify({{ ...found, errors: faults }});
            document.body.replaceChildren(pre);
        }});</script></body>"
    );
    let text = std::fs::read_to_string(page).unwrap();
    let text = text.replacen("<head>", &format!("<head>{before}"), 1);
    let at = text.rfind("</body>").unwrap();
    let text = format!("{}{after}{}", &text[..at], &text[at + 7..]);
    let copy = folder.path().join("page.html");
    std::fs::write(&copy, text).unwrap();
    let output =
        browse(browser, folder.path(), &url(&copy, fragment), &["--window-size=1300,900", "--dump-dom"]);
    let dom = String::from_utf8(output.stdout).unwrap();
    let found = dom.split_once("<pre id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let found = found.unwrap_or_else(|| panic!("nothing found in {} bytes", dom.len())).0;
    let plain = found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    serde_json::from_str(&plain).unwrap()
}

/// The pixels of a page in a window of this size.
pub fn screenshot(browser: &Path, page: &Path, fragment: &str, [width, height]: [usize; 2]) -> Vec<[u8; 3]> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("shot.png");
    let (size, shot) =
        (format!("--window-size={width},{height}"), format!("--screenshot={}", file.display()));
    browse(browser, folder.path(), &url(page, fragment), &[&size, &shot]);
    let (found, pixels) = decode(&std::fs::read(&file).unwrap());
    assert_eq!(found, [width, height]);
    pixels
}

/// Decodes a PNG of 8 bits, with or without opacity, not interlaced.
pub fn decode(file: &[u8]) -> ([usize; 2], Vec<[u8; 3]>) {
    let number = |at: usize| u32::from_be_bytes(file[at..at + 4].try_into().unwrap()) as usize;
    let (width, height) = (number(16), number(20));
    let bytes = match (file[24], file[25]) {
        (8, 2) => 3,
        (8, 6) => 4,
        other => panic!("{other:?}"),
    };
    let (mut at, mut stream) = (8, Vec::new());
    while at < file.len() {
        let length = number(at);
        if &file[at + 4..at + 8] == b"IDAT" {
            stream.extend(&file[at + 8..at + 8 + length]);
        }
        at += 12 + length;
    }
    let rows = miniz_oxide::inflate::decompress_to_vec_zlib(&stream).unwrap();
    let stride = width * bytes;
    let mut above = vec![0_u8; stride];
    let mut pixels = Vec::with_capacity(width * height);
    for row in rows.chunks(stride + 1) {
        let mut line = row[1..].to_vec();
        for i in 0..stride {
            let [left, up, corner] = [
                i.checked_sub(bytes).map_or(0, |k| line[k]),
                above[i],
                i.checked_sub(bytes).map_or(0, |k| above[k]),
            ];
            let predicted = match row[0] {
                0 => 0,
                1 => left,
                2 => up,
                3 => ((u16::from(left) + u16::from(up)) / 2) as u8,
                _ => {
                    let [a, b, c] = [left, up, corner].map(i16::from);
                    let [da, db, dc] = [b - c, a - c, a + b - 2 * c].map(i16::abs);
                    if da <= db && da <= dc {
                        left
                    } else if db <= dc {
                        up
                    } else {
                        corner
                    }
                }
            };
            line[i] = line[i].wrapping_add(predicted);
        }
        pixels.extend(line.chunks(bytes).map(|p| [p[0], p[1], p[2]]));
        above = line;
    }
    ([width, height], pixels)
}

/// Number of pixels of this color, to within a step or two per channel.
pub fn count(pixels: &[[u8; 3]], color: [u8; 3]) -> usize {
    pixels.iter().filter(|p| (0..3).all(|k| p[k].abs_diff(color[k]) <= 2)).count()
}
