//! `starpipe serve`, asked as clients of nova.astrometry.net ask, and as nobody should.

use crate::common::{Ran, cache_dir, starpipe};
use serde_json::{Value, json};
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStderr, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

const ORION: &str = "fixtures/orion/orion.png";
const WAIT: Duration = Duration::from_secs(120);

/// A server on a free port, which is killed at the end.
struct Server {
    process: Child,
    address: String,
}

struct Reply {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Reply {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body)
            .unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&self.body)))
    }
}

impl Server {
    fn command(folder: &Path, options: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_starpipe"));
        command
            .env("STARPIPE_CACHE_DIR", cache_dir())
            .env("STARPIPE_CATALOGS", "")
            .args(["serve", "--listen", "127.0.0.1:0", "--folder"])
            .arg(folder)
            .args(options)
            .stderr(Stdio::piped());
        command
    }

    fn start(folder: &Path, options: &[&str]) -> Self {
        let (server, mut log) = Self::start_with_log(folder, options);
        // Somebody must read the log.
        thread::spawn(move || log.read_to_end(&mut Vec::new()));
        server
    }

    fn start_with_log(folder: &Path, options: &[&str]) -> (Self, BufReader<ChildStderr>) {
        let mut process = Self::command(folder, options).spawn().unwrap();
        let mut log = BufReader::new(process.stderr.take().unwrap());
        let mut told = String::new();
        let address = loop {
            let start = told.len();
            assert!(log.read_line(&mut told).unwrap() > 0, "{told}");
            if let Some((_, address)) = told[start..].split_once("http://") {
                break address.trim().to_owned();
            }
        };
        (Self { process, address }, log)
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).unwrap();
        stream.set_read_timeout(Some(WAIT)).unwrap();
        stream
    }

    fn send(&self, request: &[u8]) -> Reply {
        let mut stream = self.connect();
        // A server that refuses a body does not read it.
        let _ = stream.write_all(request);
        reply(stream)
    }

    fn get(&self, path: &str) -> Reply {
        self.send(
            format!("GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n")
                .as_bytes(),
        )
    }

    fn post(&self, path: &str, head: &str, body: &[u8]) -> Reply {
        let length = body.len();
        let head = format!(
            "POST {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {length}\r\n{head}\r\n\r\n"
        );
        self.send(&[head.as_bytes(), body].concat())
    }

    fn call(&self, name: &str, arguments: &Value) -> Value {
        let body = format!("request-json={arguments}").replace('+', "%2B");
        let kind = "Content-Type: application/x-www-form-urlencoded";
        self.post(&format!("/api/{name}"), kind, body.as_bytes())
            .json()
    }

    fn session(&self) -> String {
        let session = self.call("login", &json!({"apikey": "any"}));
        session["session"].as_str().unwrap().to_owned()
    }

    /// Uploads as astrometry.net's client does: line feeds alone around the boundary.
    fn upload(&self, name: &str, file: &[u8], settings: &Value) -> Reply {
        let mut settings = settings.clone();
        settings["session"] = self.session().into();
        let head = format!(
            "--==7==\nContent-Type: text/plain\r\nContent-disposition: form-data; name=\"request-json\"\r\n\r\n\
             {settings}\n--==7==\nContent-disposition: form-data; name=\"file\"; filename=\"{name}\"\r\n\r\n"
        );
        let body = [head.as_bytes(), file, b"\n--==7==--\n"].concat();
        let kind = "Content-Type: multipart/form-data; boundary=\"==7==\"";
        self.post("/api/upload", kind, &body)
    }

    /// The number of a job, once it is done.
    fn done(&self, submitted: &Value) -> u64 {
        assert_eq!(submitted["status"], "success", "{submitted}");
        let id = submitted["subid"].as_u64().unwrap();
        let begun = Instant::now();
        while self.get(&format!("/api/jobs/{id}")).json()["status"] == "solving" {
            assert!(begun.elapsed() < WAIT, "job {id} does not end");
            thread::sleep(Duration::from_millis(50));
        }
        id
    }

    /// The number of a job that was in the folder before the server was started, once it is done.
    fn done_of_folder(&self, id: u64) -> u64 {
        self.done(&json!({"status": "success", "subid": id}))
    }

    fn info(&self, id: u64) -> Value {
        self.get(&format!("/api/jobs/{id}/info/")).json()
    }

    fn solve(&self, query: &str, file: &[u8]) -> Reply {
        self.post(&format!("/solve{query}"), "Content-Type: image/png", file)
    }

    fn kill(mut self) {
        self.process.kill().unwrap();
        self.process.wait().unwrap();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn reply(mut stream: TcpStream) -> Reply {
    let mut bytes = Vec::new();
    // What was told before the connection was reset counts.
    let _ = stream.read_to_end(&mut bytes);
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n");
    let end = end.unwrap_or_else(|| panic!("{}", String::from_utf8_lossy(&bytes)));
    let head = String::from_utf8(bytes[..end].to_vec())
        .unwrap()
        .to_lowercase();
    let status = head.split(' ').nth(1).unwrap().parse().unwrap();
    let body = bytes[end + 4..].to_vec();
    Reply { status, head, body }
}

fn orion() -> Vec<u8> {
    fs::read(ORION).unwrap()
}

/// The report of `process`.
fn processed(out: Option<&Path>) -> Value {
    let mut command = starpipe();
    command.args(["process", ORION, "--format", "json"]);
    if let Some(out) = out {
        command.arg("--out").arg(out);
    }
    serde_json::from_str(&Ran::new(&mut command).stdout).unwrap()
}

fn near(value: &Value, expected: f64, tolerance: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < tolerance, "{value} {expected}");
}

/// The cards of a FITS header, without history.
fn cards(header: &[u8]) -> Vec<&str> {
    let cards = header.chunks(80).map(|card| str::from_utf8(card).unwrap());
    cards.filter(|card| !card.starts_with("HISTORY")).collect()
}

#[test]
fn an_upload_is_answered_as_process_answers() {
    let folder = tempfile::tempdir().unwrap();
    let out = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let report = processed(Some(out.path()));
    let id = server.done(&server.upload("orion.png", &orion(), &json!({})).json());
    let calibration = server.get(&format!("/api/jobs/{id}/calibration")).json();
    let attitude = &report["attitude"];
    near(
        &calibration["ra"],
        attitude["ra_deg"].as_f64().unwrap(),
        1e-4,
    );
    near(
        &calibration["dec"],
        attitude["dec_deg"].as_f64().unwrap(),
        1e-4,
    );
    let focal_px = report["optics"]["focal_length_px"].as_f64().unwrap();
    near(
        &calibration["pixscale"],
        (1.0 / focal_px).to_degrees() * 3600.0,
        1e-3,
    );
    assert_eq!(calibration["parity"], 1.0);
    let width = report["width"].as_f64().unwrap();
    near(
        &calibration["width_arcsec"],
        calibration["pixscale"].as_f64().unwrap() * width,
        1e-6,
    );

    let header = server.get(&format!("/wcs_file/{id}"));
    let expected = fs::read(out.path().join("orion.wcs")).unwrap();
    assert_eq!(cards(&header.body), cards(&expected));
    assert!(header.head.contains("content-type: application/fits"));

    let info = server.info(id);
    assert_eq!(info["status"], "success");
    assert_eq!(info["original_filename"], "orion.png");
    assert_eq!(info["calibration"], calibration);
    assert_eq!(info["sentence"], report["sentence"]);
    let names = info["objects_in_field"].as_array().unwrap();
    assert!(names.contains(&json!("Rigel")) && info["machine_tags"] == info["objects_in_field"]);
    let marked = server.get(&format!("/api/jobs/{id}/annotations/")).json();
    let marked = marked["annotations"].as_array().unwrap();
    let rigel = marked
        .iter()
        .find(|object| object["names"][0] == "Rigel")
        .unwrap();
    let annotations = report["annotations"].as_array().unwrap();
    let expected = annotations
        .iter()
        .find(|object| object["label"] == "Rigel")
        .unwrap();
    near(
        &rigel["pixelx"],
        expected["x"].as_f64().unwrap() + 1.0,
        1e-6,
    );
    let submission = server.get(&format!("/api/submissions/{id}")).json();
    assert_eq!(submission["jobs"], json!([id]));
    assert_eq!(submission["job_calibrations"], json!([[id, id]]));
    assert_ne!(submission["processing_finished"], "None");
    for (path, start) in [
        ("axy_file", &b"SIMPLE"[..]),
        ("rdls_file", b"SIMPLE"),
        ("corr_file", b"SIMPLE"),
        ("new_fits_file", b"SIMPLE"),
        ("annotated_display", b"\xff\xd8"),
        ("red_green_image_display", b"\x89PNG"),
        ("extraction_image_display", b"\x89PNG"),
        ("joblog", b"orion.png: success"),
    ] {
        let file = server.get(&format!("/{path}/{id}"));
        assert_eq!(file.status, 200, "{path}");
        assert!(file.body.starts_with(start), "{path}");
    }
}

#[test]
fn solve_answers_with_the_json_of_process() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let mut expected = processed(None);
    expected["frame"] = json!("orion.png");
    let form = |file: &[u8]| {
        let head = "--7\r\nContent-Disposition: form-data; name=\"fov\"\r\n\r\n\r\n--7\r\nContent-Disposition: \
                    form-data; name=\"f\"; filename=\"orion.png\"\r\n\r\n";
        [head.as_bytes(), file, b"\r\n--7--\r\n"].concat()
    };
    let kind = "Content-Type: multipart/form-data; boundary=7";
    for mut reply in [
        server.solve("?name=orion.png&max-stars=", &orion()),
        server.post("/solve/", kind, &form(&orion())),
    ] {
        let mut report = reply.json();
        report["timing_ms"] = std::mem::take(&mut expected["timing_ms"]);
        expected["timing_ms"] = report["timing_ms"].clone();
        assert_eq!(report, expected);
        reply.head.truncate(12);
        assert_eq!(reply.head, "http/1.1 200");
    }
    let pgm = [b"P5 64 64 255\n".to_vec(), vec![9; 64 * 64]].concat();
    let empty = server.solve("", &pgm);
    assert_eq!(
        (empty.status, &empty.json()["status"]),
        (200, &json!("not_identified"))
    );
    let cut = &orion()[..9000];
    for (status, query, file) in [
        (400, "?fov=wide", &orion()[..]),
        (400, "?fov-deg=20", &orion()),
        (415, "", b"Hello World"),
        (415, "", b""),
        (422, "", cut),
        (422, "", b"P5 2 2 255\nabcd"),
    ] {
        let refused = server.solve(query, file);
        assert_eq!(refused.status, status, "{query} {}", refused.json());
        assert!(refused.json()["error"].is_string());
    }
    assert_eq!(server.get("/solve").status, 405);
    assert_eq!(
        server.post("/solve", kind, &form(&orion())[..5000]).status,
        400
    );
}

#[test]
fn solve_answers_with_other_results_of_process() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let out = folder.path().join("out");
    let report = processed(Some(&out));
    let made = |answer: &str| {
        let reply = server.solve(&format!("?name=orion.png&answer={answer}"), &orion());
        assert_eq!(reply.status, 200, "{answer}");
        reply.body
    };
    let written = |name: &str| fs::read(out.join(name)).unwrap();
    let table = String::from_utf8(written("orion.csv")).unwrap();
    let table = table.replace(ORION, "orion.png");
    assert_eq!(String::from_utf8(made("csv")).unwrap(), table);
    assert_eq!(cards(&made("wcs")), cards(&written("orion.wcs")));
    assert!(made("png") == written("orion.png"));
    let plain = server.solve("?answer=png&rings=none&draw=none", &orion());
    let drawn = server.solve("?answer=png&rings=all&draw=grid", &orion());
    assert_eq!((plain.status, drawn.status), (200, 200));
    assert_ne!(plain.body, drawn.body);
    let html = server.solve("?name=orion.png&answer=html", &orion());
    assert!(html.head.contains("content-type: text/html"));
    assert!(
        html.head.contains("policy: sandbox allow-scripts; default"),
        "{}",
        html.head
    );
    let view = server.solve("?name=orion.png&answer=view&page=1", &orion());
    let view = view.json();
    let shown: Value = serde_json::from_str(view["json"].as_str().unwrap()).unwrap();
    assert_eq!(shown["attitude"], report["attitude"]);
    let data: Value = serde_json::from_str(view["data"].as_str().unwrap()).unwrap();
    assert!(data.is_object() && view["html"].as_str().unwrap().contains("id=\"view\""));
    for (status, query) in [
        (400, "?answer=xml"),
        (400, "?draw=grid"),
        (400, "?page=0"),
        (422, "?page=2"),
    ] {
        assert_eq!(server.solve(query, &orion()).status, status, "{query}");
    }
    let pgm = [b"P5 64 64 255\n".to_vec(), vec![9; 64 * 64]].concat();
    assert_eq!(server.solve("?answer=wcs", &pgm).status, 422);
}

#[test]
fn hints_that_are_wrong_are_dropped_and_the_notes_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let wrong = json!({"scale_units": "arcsecperpix", "scale_lower": 1.0, "scale_upper": 1.2,
                       "center_ra": 200.0, "center_dec": 50.0, "radius": 2.0, "parity": 1, "tweak_order": 4,
                       "downsample_factor": 2, "invert": true, "allow_commercial_use": "n"});
    let id = server.done(&server.upload("a.png", &orion(), &wrong).json());
    let info = server.info(id);
    near(&info["calibration"]["ra"], 83.7, 0.01);
    let notes = info["notes"].as_array().unwrap();
    for code in ["scale_wrong", "direction_wrong"] {
        assert!(notes.iter().any(|note| note["code"] == code), "{notes:?}");
    }
}

#[test]
fn lists_of_stars_are_solved() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let report = processed(None);
    let stars = report["stars"].as_array().unwrap();
    let along = |axis: &str| -> Vec<f64> {
        let places = stars.iter().map(|star| star[axis].as_f64().unwrap() + 1.0);
        places.collect()
    };
    let mut settings = json!({"x": along("x"), "y": along("y"), "image_width": report["width"],
                              "image_height": report["height"], "session": server.session()});
    // astroquery sends lists to url_upload, astrometry.net's client to upload.
    for name in ["url_upload", "upload"] {
        let info = server.info(server.done(&server.call(name, &settings)));
        assert_eq!(info["status"], "success", "{info}");
        near(&info["calibration"]["ra"], 83.7, 0.01);
        near(&info["calibration"]["dec"], -0.4, 0.01);
    }
    // KStars uploads a table of FITS.
    let id = server.done(&server.upload("orion.png", &orion(), &json!({})).json());
    let table = server.get(&format!("/axy_file/{id}")).body;
    let sides = json!({"image_width": report["width"], "image_height": report["height"]});
    let id = server.done(&server.upload("a.axy", &table, &sides).json());
    near(&server.info(id)["calibration"]["ra"], 83.7, 0.01);
    // A list has no picture, and nobody is asked again.
    for path in ["annotated_display", "extraction_image_display"] {
        assert_eq!(server.get(&format!("/{path}/{id}")).status, 404, "{path}");
    }
    settings["y"] = json!([1.0]);
    let refused = server.call("upload", &settings);
    assert!(
        refused["errormessage"]
            .as_str()
            .unwrap()
            .contains("as long as"),
        "{refused}"
    );
}

#[test]
fn only_keys_of_the_file_are_accepted() {
    let folder = tempfile::tempdir().unwrap();
    let keys = folder.path().join("keys");
    fs::write(&keys, "alpha\n").unwrap();
    let server = Server::start(
        &folder.path().join("jobs"),
        &["--keys", keys.to_str().unwrap()],
    );
    let refused = server.call("login", &json!({"apikey": "beta"}));
    assert_eq!(
        refused,
        json!({"status": "error", "errormessage": "bad apikey"})
    );
    let session = server.call("login", &json!({"apikey": "alpha"}))["session"].clone();
    let list = |session: Value| json!({"session": session, "x": [1], "y": [1]});
    let refused = server.call("upload", &list(json!("other")));
    let message = refused["errormessage"].as_str().unwrap();
    assert_eq!(message, "no session with key \"other\"");
    assert_eq!(server.call("upload", &list(session))["status"], "success");
    let solve = |head: &str| server.post("/solve", head, &orion()).status;
    assert_eq!(solve("Authorization: Bearer beta"), 401);
    assert_eq!(solve("X: y"), 401);
    assert_eq!(solve("Authorization: Bearer alpha"), 200);
}

#[test]
fn bodies_are_limited_in_length_and_in_time() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--max-upload", "1", "--send-time", "1"]);
    let head = |more: &str| {
        format!("POST /solve HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{more}\r\n\r\n")
    };
    // A length that is only claimed, and one that is not.
    let claimed = server.send(head("Content-Length: 1000000000").as_bytes());
    assert_eq!(claimed.status, 413);
    let mut stream = server.connect();
    stream
        .write_all(head("Transfer-Encoding: chunked").as_bytes())
        .unwrap();
    let chunk = [b"10000\r\n".to_vec(), vec![b'a'; 0x10000], b"\r\n".to_vec()].concat();
    let sent = (0..1000)
        .take_while(|_| stream.write_all(&chunk).is_ok())
        .count();
    assert!(sent < 1000, "an endless body is read to its end");
    // Half a body, and then nothing.
    let begun = Instant::now();
    let half = server.send(&[head("Content-Length: 1000").as_bytes(), b"abc"].concat());
    assert_eq!(half.status, 408, "{}", half.head);
    // Half a body, and no client any more.
    let stream = server.connect();
    (&stream)
        .write_all(&[head("Content-Length: 1000").as_bytes(), b"abc"].concat())
        .unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    assert!([400, 408].contains(&reply(stream).status));
    // Half a head.
    let mut stream = server.connect();
    stream.write_all(b"GET / HTTP/1.1\r\nHost: ").unwrap();
    let _ = stream.read_to_end(&mut Vec::new());
    assert!(begun.elapsed() < Duration::from_secs(20));
    assert_eq!(server.solve("", &orion()).status, 200);
}

#[test]
fn the_json_of_calls_is_limited() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let kind = "Content-Type: application/x-www-form-urlencoded";
    let call = |name: &str, bytes: usize| {
        let body = format!("request-json={}", "[".repeat(bytes));
        server.post(&format!("/api/{name}"), kind, body.as_bytes())
    };
    for name in ["login", "myjobs", "submission_images"] {
        let refused = call(name, 100_000);
        assert_eq!(refused.status, 413, "{name}");
        let message = refused.json()["errormessage"].clone();
        assert_eq!(message, "the body is too large: at most 64 kB are accepted");
    }
    // A length that is only claimed, of what is no file.
    let head = "POST /api/upload HTTP/1.1\r\nHost: localhost\r\nContent-Length: 20000000\r\n\r\n";
    assert_eq!(server.send(head.as_bytes()).status, 413);
    for (bytes, status) in [(5_000_000, 413), (100_000, 200)] {
        assert_eq!(call("upload", bytes).status, status, "{bytes}");
        assert_eq!(call("url_upload", bytes).status, status, "{bytes}");
    }
    let long = vec![1; 100_001];
    let refused = server.call("upload", &json!({"session": "a", "x": long, "y": long}));
    let message = refused["errormessage"].as_str().unwrap();
    assert!(message.contains("at most 100000"), "{message}");
}

#[test]
fn who_is_refused_early_reads_why() {
    let folder = tempfile::tempdir().unwrap();
    let keys = folder.path().join("keys");
    fs::write(&keys, "alpha\n").unwrap();
    let server = Server::start(
        &folder.path().join("jobs"),
        &["--keys", keys.to_str().unwrap()],
    );
    let head = "POST /solve HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: 7000000\r\n\r\n";
    let mut stream = server.connect();
    stream.write_all(head.as_bytes()).unwrap();
    for _ in 0..7 {
        thread::sleep(Duration::from_millis(20));
        stream.write_all(&[0; 1_000_000]).unwrap();
    }
    assert_eq!(reply(stream).status, 401);
}

#[test]
fn pages_of_other_sites_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--host", "proxy.example"]);
    let ask = |host: &str, more: &str| {
        let request =
            format!("POST /solve HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n{more}\r\n");
        server.send(request.as_bytes())
    };
    // A name that was given the address of this computer.
    let refused = ask("evil.example", "");
    assert_eq!(refused.status, 421);
    let message = refused.json()["error"].to_string();
    assert!(message.contains("--host"), "{message}");
    let address = &*server.address;
    let own = &*format!("http://{address}");
    for (host, origin, status) in [
        (address, "http://evil.example", 403),
        (address, "null", 403),
        (address, own, 415),
        ("proxy.example", "https://proxy.example", 415),
        ("nova.astrometry.net", "", 415),
    ] {
        let origin = match origin {
            "" => String::new(),
            origin => format!("Origin: {origin}\r\n"),
        };
        assert_eq!(ask(host, &origin).status, status, "{host} {origin}");
    }
}

#[test]
fn a_folder_of_something_else_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("2023")).unwrap();
    let refused = Server::command(folder.path(), &[]).output().unwrap();
    let told = String::from_utf8(refused.stderr).unwrap();
    assert!(told.contains("no folder of jobs"), "{told}");
    assert_eq!(refused.status.code(), Some(1));
    assert!(folder.path().join("2023").exists());
}

#[test]
fn jobs_that_cannot_be_done_are_answered() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("lock"), "").unwrap();
    let job = json!({"name": "a.png", "settings": {}, "received": ""}).to_string();
    // One that ended the server twice, one without its upload, one that ended it once.
    for number in ["1", "2", "3"] {
        let path = folder.path().join(number);
        fs::create_dir(&path).unwrap();
        fs::write(path.join("upload"), orion()).unwrap();
        fs::write(path.join("job.json"), &job).unwrap();
    }
    fs::write(folder.path().join("1/begun"), "11").unwrap();
    fs::remove_file(folder.path().join("2/upload")).unwrap();
    fs::write(folder.path().join("3/begun"), "1").unwrap();
    let server = Server::start(folder.path(), &["--jobs", "1"]);
    for (number, status, reason) in [
        (1, "failure", "the server ended while it solved this".into()),
        (2, "failure", "the server could not read the upload".into()),
        (3, "success", Value::Null),
    ] {
        let info = server.info(server.done_of_folder(number));
        assert_eq!(
            (&info["status"], &info["reason"]),
            (&json!(status), &reason)
        );
        assert!(!folder.path().join(format!("{number}/begun")).exists());
    }
    for path in ["annotated_display", "new_fits_file"] {
        assert_eq!(server.get(&format!("/{path}/1")).status, 404, "{path}");
    }
}

#[test]
fn what_is_not_identified_has_pictures_and_no_copy_with_coordinates() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &[]);
    let pgm = [b"P5 64 64 255\n".to_vec(), vec![9; 64 * 64]].concat();
    let id = server.done(&server.upload("a.pgm", &pgm, &json!({})).json());
    for (path, status) in [
        ("new_fits_file", 404),
        ("wcs_file", 404),
        ("annotated_display", 200),
    ] {
        assert_eq!(
            server.get(&format!("/{path}/{id}")).status,
            status,
            "{path}"
        );
    }
}

#[test]
fn a_log_that_nobody_reads_costs_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    let (server, log) = Server::start_with_log(folder.path(), &[]);
    drop(log);
    let id = server.done(&server.upload("a.png", &orion(), &json!({})).json());
    assert_eq!(server.info(id)["status"], "success");
    assert_eq!(server.solve("", &orion()).status, 200);
}

#[test]
fn names_are_never_paths() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(&folder.path().join("jobs"), &[]);
    let names = [
        "../../escaped.png",
        "/tmp/escaped.png",
        "..\\\\escaped.png",
        "a/b/..",
    ];
    for name in names {
        let id = server.done(&server.upload(name, b"no picture", &json!({})).json());
        let info = server.info(id);
        let shown = info["original_filename"].as_str().unwrap();
        assert!(["escaped.png", "upload"].contains(&shown), "{shown}");
        assert_eq!(info["status"], "failure");
        assert!(
            info["reason"].as_str().unwrap().contains("not an image"),
            "{info}"
        );
        assert_eq!(server.get(&format!("/wcs_file/{id}")).status, 404);
        let none = server.get(&format!("/api/jobs/{id}/calibration")).json();
        assert!(
            none["error"]
                .as_str()
                .unwrap()
                .starts_with("no calibration")
        );
    }
    let outside: Vec<_> = fs::read_dir(folder.path()).unwrap().flatten().collect();
    assert_eq!(outside.len(), 1);
    for path in [
        "/wcs_file/../../../../etc/passwd",
        "/wcs_file/..%2f..%2fetc%2fpasswd",
        "/../Cargo.toml",
        "/%2e%2e/Cargo.toml",
        "//etc/passwd",
        "/wcs_file/999999999999999999999",
        "/api/jobs/1/info",
        "/api/jobs/-1",
        "/index.html",
    ] {
        assert_eq!(server.get(path).status, 404, "{path}");
    }
}

#[test]
fn who_comes_when_the_queue_is_full_is_sent_away() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--jobs", "1", "--queue", "1"]);
    let orion = orion();
    let replies: Vec<Reply> = thread::scope(|scope| {
        let ask = || server.solve("", &orion);
        let asked: Vec<_> = (0..12).map(|_| scope.spawn(ask)).collect();
        asked
            .into_iter()
            .map(|reply| reply.join().unwrap())
            .collect()
    });
    let (answered, refused): (Vec<_>, Vec<_>) =
        replies.iter().partition(|reply| reply.status == 200);
    assert!(!answered.is_empty() && !refused.is_empty());
    for reply in refused {
        assert_eq!(reply.status, 503);
        assert!(reply.head.contains("retry-after: "), "{}", reply.head);
    }
    let metrics = String::from_utf8(server.get("/metrics").body).unwrap();
    let counted = format!(
        "starpipe_frames_total{{outcome=\"identified\"}} {}",
        answered.len()
    );
    assert!(metrics.contains(&counted), "{metrics}");
    assert!(metrics.contains("starpipe_queue_length 0\n"), "{metrics}");
}

#[test]
fn what_was_uploaded_is_solved_after_a_kill() {
    let folder = tempfile::tempdir().unwrap();
    let server = Server::start(folder.path(), &["--jobs", "1"]);
    let first = server.done(&server.upload("first.png", &orion(), &json!({})).json());
    let before = server.info(first);
    let later: Vec<Value> = (0..4)
        .map(|_| server.upload("later.png", &orion(), &json!({})).json())
        .collect();
    server.kill();
    let server = Server::start(folder.path(), &[]);
    assert_eq!(server.info(first), before);
    for submitted in &later {
        let id = server.done(submitted);
        assert_eq!(server.info(id)["status"], "success");
        assert!(id > first);
    }
    let jobs = server.call("myjobs", &json!({"session": "a"}));
    assert_eq!(jobs["jobs"].as_array().unwrap().len(), 5);
}

/// Sends so many signals while a frame is solved; the exit status, and the answer for the frame.
#[cfg(unix)]
fn signalled(signals: usize) -> (Option<i32>, u16) {
    let folder = tempfile::tempdir().unwrap();
    let mut server = Server::start(folder.path(), &["--jobs", "1"]);
    let address = server.address.clone();
    let asked = thread::spawn(move || {
        let mut stream = TcpStream::connect(address).unwrap();
        let file = orion();
        let length = file.len();
        let head = format!(
            "POST /solve HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {length}\r\n\r\n"
        );
        stream
            .write_all(&[head.as_bytes(), &file].concat())
            .unwrap();
        reply(stream).status
    });
    while !String::from_utf8_lossy(&server.get("/metrics").body).contains("starpipe_running 1\n") {
        assert!(!asked.is_finished(), "too fast to be seen");
    }
    let id = server.process.id().to_string();
    for _ in 0..signals {
        // The last may come too late.
        let _ = Command::new("kill").arg(&id).status().unwrap();
        thread::sleep(Duration::from_millis(20));
    }
    (server.process.wait().unwrap().code(), asked.join().unwrap())
}

#[test]
#[cfg(unix)]
fn a_signal_ends_it_when_running_frames_are_done() {
    assert_eq!(signalled(1), (Some(0), 200));
}

#[test]
#[cfg(unix)]
fn what_a_second_signal_ends_is_answered() {
    let (exit, status) = signalled(2);
    assert_eq!(exit, Some(0));
    assert!([200, 503].contains(&status), "{status}");
}

#[test]
fn addresses_are_fetched_only_where_it_is_allowed_and_they_are_public() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |server: &Server, url: &str| {
        let answer = server.call("url_upload", &json!({"session": "a", "url": url}));
        assert_eq!(answer["status"], "error", "{url}");
        answer["errormessage"].as_str().unwrap().to_owned()
    };
    let server = Server::start(&folder.path().join("a"), &[]);
    let message = refused(&server, "http://example.com/a.png");
    assert!(message.contains("fetches no addresses"), "{message}");
    let server = Server::start(&folder.path().join("b"), &["--allow-url"]);
    let own = format!("http://{}/openapi.json", server.address);
    for url in [
        &*own,
        "http://127.0.0.1/a.png",
        "http://localhost/a.png",
        "http://[::1]/a.png",
        "http://[::ffff:127.0.0.1]/a.png",
        "http://169.254.169.254/latest/meta-data/",
        "http://10.0.0.1/a.png",
        "http://0.0.0.0/a.png",
    ] {
        assert_eq!(refused(&server, url), "the address is not public", "{url}");
    }
    for url in [
        "https://example.com/a.png",
        "file:///etc/passwd",
        "gopher://a",
    ] {
        let message = refused(&server, url);
        assert!(
            message.contains("http://") || message.contains("invalid"),
            "{message}"
        );
    }
}

#[test]
fn answers_have_headers_for_browsers() {
    let folder = tempfile::tempdir().unwrap();
    let page = tempfile::tempdir().unwrap();
    fs::write(page.path().join("index.html"), "<p>page").unwrap();
    fs::write(page.path().join("a.wasm"), "w").unwrap();
    let server = Server::start(folder.path(), &["--page", page.path().to_str().unwrap()]);
    for path in [
        "/",
        "/health",
        "/metrics",
        "/openapi.json",
        "/a.wasm",
        "/nothing",
        "/api/jobs/1",
    ] {
        let head = server.get(path).head;
        for name in [
            "content-security-policy: default-src 'none'",
            "x-content-type-options: nosniff",
            "starpipe: serve",
        ] {
            assert!(head.contains(name), "{path}: {head}");
        }
        assert!(!head.contains("access-control-"), "{path}: {head}");
    }
    assert_eq!(server.get("/").body, b"<p>page");
    assert!(
        server
            .get("/a.wasm")
            .head
            .contains("content-type: application/wasm")
    );
    let described = server.get("/openapi.json").json();
    for path in described["paths"].as_object().unwrap().keys() {
        let path = path.replace("{id}", "1");
        // A route that is there: no such job, or not with GET.
        let found = server.get(&path);
        let told = String::from_utf8_lossy(&found.body);
        assert!(!told.contains("no such address"), "{path}: {told}");
    }
    let foreign = server.post("/solve", "Sec-Fetch-Site: cross-site", b"a");
    assert_eq!(foreign.status, 403);
}
