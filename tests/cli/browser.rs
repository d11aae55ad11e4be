//! A real browser without a window: Chromium, if installed.

use crate::socket;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use tungstenite::Message;

const OPTIONS: [&str; 7] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-extensions",
];

/// Path of Chromium: the variable `CHROMIUM`, or one of its usual names on the path.
fn find() -> Option<PathBuf> {
    if let Some(given) = std::env::var_os("CHROMIUM") {
        return Some(given.into());
    }
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    names.iter().find_map(|name| folders.iter().map(|f| f.join(name)).find(|p| p.is_file()))
}

/// Loads a copy of `page`, waits until its replays are ready, and runs the body of an async function that
/// returns an object. Returns that object, after checking that the page had no errors. Without a browser:
/// `None`, and a printed line.
///
/// The copy has a script in front that records every error, and one behind that leaves the object in the
/// document. `pixels(canvas, color)` counts the pixels of a color.
pub fn drive(page: &Path, fragment: &str, script: &str) -> Option<serde_json::Value> {
    let Some(browser) = find() else {
        eprintln!("SKIPPED {}: no Chromium on the path; install the package chromium", page.display());
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let before = "<script>window.faults = []; addEventListener('error', (e) => faults.push(String(e.message)));
        addEventListener('unhandledrejection', (e) => faults.push(String(e.reason)));
        for (const level of ['error', 'warn']) console[level] = (...all) => faults.push(all.join(' '));</script>";
    let after = format!(
        "<script>addEventListener('load', async () => {{
            const pause = (ms) => new Promise((done) => setTimeout(done, ms));
            const pixels = (canvas, color) => {{
                const d = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
                let sum = 0;
                for (let i = 0; i < d.length; i += 4) sum += color.every((v, k) => Math.abs(d[i + k] - v) <= 2);
                return sum;
            }};
            for (let i = 0; i < 100 && document.querySelector('.replay:not([data-ready])'); i++) await pause(50);
            let found;
            try {{ found = await (async () => {{ {script} }})(); }} catch (e) {{ faults.push(String(e)); }}
            const pre = document.createElement('pre');
            pre.id = 'found';
            pre.textContent = JSON.stringify({{ ...found, faults }});
            document.body.replaceChildren(pre);
        }});</script></body>"
    );
    let text = std::fs::read_to_string(page).unwrap();
    let (head, tail) = text.rsplit_once("</body>").unwrap();
    let copy = folder.path().join("page.html");
    let head = head.replacen("<head>", &format!("<head>{before}"), 1);
    std::fs::write(&copy, format!("{head}{after}{tail}")).unwrap();
    let output = Command::new(browser)
        .args(OPTIONS)
        .args(["--virtual-time-budget=20000", "--dump-dom"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .args(["--window-size=1300,900", &format!("file://{}#{fragment}", copy.display())])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let dom = String::from_utf8(output.stdout).unwrap();
    let found = dom.split_once("<pre id=\"found\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let found = found.unwrap_or_else(|| panic!("nothing found in {} bytes", dom.len())).0;
    let plain = found.replace("&lt;", "<").replace("&gt;", ">").replace("&amp;", "&");
    let found: serde_json::Value = serde_json::from_str(&plain).unwrap();
    assert_eq!(found["faults"], serde_json::json!([]), "{found}");
    Some(found)
}

/// Opens an address and runs the body of an async function there, in real time, by the DevTools protocol. Returns its
/// object, after checking that the page had no errors. Without a browser: `None`, and a
/// printed line.
pub fn visit(address: &str, script: &str) -> Option<Value> {
    let Some(browser) = find() else {
        eprintln!("SKIPPED {address}: no Chromium on the path; install the package chromium");
        return None;
    };
    let folder = tempfile::tempdir().unwrap();
    let mut child = Command::new(browser)
        .args(OPTIONS)
        .args(["--remote-debugging-port=0", "--window-size=1400,1000"])
        .arg(format!("--user-data-dir={}", folder.path().display()))
        .arg("about:blank")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let own =
        lines.map_while(Result::ok).find_map(|line| Some(line.split_once("ws://")?.1.to_string())).unwrap();
    let (host, path) = own.split_once('/').unwrap();
    let mut tools = socket::connect(host, &format!("/{path}"), None).unwrap();
    let (mut number, mut faults) = (0, Vec::new());
    let mut call = |session: Option<&str>, method: &str, parameters: Value| -> Value {
        number += 1;
        let mut message = json!({ "id": number, "method": method, "params": parameters });
        session.into_iter().for_each(|session| message["sessionId"] = session.into());
        tools.send(Message::text(message.to_string())).unwrap();
        loop {
            let Message::Text(text) = tools.read().unwrap() else { continue };
            let answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == number {
                return answer["result"].clone();
            }
            if answer["method"] == "Runtime.exceptionThrown" {
                faults.push(answer["params"]["exceptionDetails"].to_string());
            }
        }
    };
    let target = call(None, "Target.createTarget", json!({ "url": "about:blank" }));
    let attached =
        call(None, "Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }));
    let session = Some(attached["sessionId"].as_str().unwrap());
    call(session, "Runtime.enable", json!({}));
    call(session, "Page.enable", json!({}));
    call(session, "Page.navigate", json!({ "url": address }));
    let expression = format!(
        "(async () => {{ const pause = (ms) => new Promise((done) => setTimeout(done, ms));
            const until = async (is) => {{ for (let i = 0; i < 400 && !is(); i++) await pause(50); return is(); }};
            {script} }})()"
    );
    let options = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
    let found = call(session, "Runtime.evaluate", options);
    let _ = child.kill();
    let _ = child.wait();
    assert!(faults.is_empty() && found["exceptionDetails"].is_null(), "{faults:?} {found}");
    Some(found["result"]["value"].clone())
}
