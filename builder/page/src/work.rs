//! What the page asks for, step by step.

use std::{path::Path, sync::Arc};

use anyhow::{Context, Result, bail};
use gestus_core::{Database, Method};
use gestus_database::stream::{
    Streamed,
    input::Input,
    translate::{degraded_words, figures, translate},
    verdict::Verdict,
};
use gestus_motion::{
    capture::{Document, documents},
    clip::Clip,
    formats::gltf,
};
use serde::Deserialize;
use serde_json::{Value, json};

use crate::settings::{Animation, Settings};

/// The page's state, and the buffers that it shares with JavaScript.
#[derive(Default)]
pub struct Page {
    /// JSON of the call, and then of the answer.
    pub text: Vec<u8>,
    /// Bytes of the call, and then of the answer.
    pub data: Vec<u8>,
    database: Option<Database<'static>>,
    file: String,
    documents: Vec<(String, Document)>,
    input: Option<Input>,
    streamed: Option<Streamed>,
}

/// A file's name, for its format and for messages.
#[derive(Deserialize)]
struct Named {
    name: String,
}

impl Page {
    /// Opens the database in the data. Answers with its names. A database is kept for good: a page opens few.
    pub fn database(&mut self) -> Result<Value> {
        let bytes: &'static [u8] = Vec::leak(std::mem::take(&mut self.data));
        let database = Database::open(bytes).map_err(|e| anyhow::anyhow!("{e}"))?;
        let manifest = database.manifest().map_err(|e| anyhow::anyhow!("{e}"))?;
        let names = |names: gestus_core::blob::Names<'_>| names.iter().map(String::from).collect::<Vec<_>>();
        let methods = Method::ALL.into_iter().filter(|m| m.is_available_in(&database)).map(Method::name);
        let answer = json!({
            "styles": names(manifest.styles),
            "actions": names(manifest.actions),
            "groups": names(manifest.groups),
            "methods": methods.collect::<Vec<_>>(),
            "effort": database.dial().map(|dial| json!({"rest": dial.rest().factors(), "range": dial.range()})),
            "frames": database.counts().frames,
            "rate": database.rate_hz(),
        });
        (self.input, self.streamed) = (None, None);
        self.database = Some(database);
        Ok(answer)
    }

    /// Reads the clip in the data, whose name is in the text. Answers with the names of its animations.
    pub fn clip(&mut self) -> Result<Value> {
        let Named { name } = serde_json::from_slice(&self.text)?;
        let bytes: Arc<[u8]> = std::mem::take(&mut self.data).into();
        (self.input, self.streamed) = (None, None);
        self.documents = documents(Path::new(&name), &bytes)?;
        self.file = name;
        let names: Vec<&String> = self.documents.iter().map(|(name, _)| name).collect();
        Ok(json!({ "animations": names }))
    }

    /// Takes an animation of the clip as the input, with what the text tells about it. Answers with its skeleton, its ground
    /// and what was noted in reading; the data is its joints' places, metres, Y up, shape `[frames x joints x 3]`.
    pub fn animation(&mut self) -> Result<Value> {
        let animation: Animation = serde_json::from_slice(&self.text)?;
        let database = self.database.context("there is no database")?;
        let (_, document) = self.documents.get(animation.index).context("there is no such animation")?;
        let path = Path::new(&self.file);
        let input = Input::of_document(document.clone(), path, &database, &animation.reading()?)?;
        self.streamed = None;
        self.data = places(&input.upright(&input.clip));
        let skeleton = &input.clip.skeleton;
        let answer = json!({
            "joints": skeleton.names,
            "parents": skeleton.parents,
            "frames": input.clip.frames.len(),
            "rate": input.clip.rate_hz,
            "ground": input.json(),
            "metres": input.binding.unit().metres(),
            "retargeted": input.retarget().is_some(),
            "notes": input.notes().collect::<Vec<_>>(),
        });
        self.input = Some(input);
        Ok(answer)
    }

    /// Translates the input with the settings in the text. Answers with the figures of `gestus translate`; the data is
    /// the joints' places in the output, as in [`animation`](Self::animation), and behind them those of the database's body,
    /// on a floor at zero, in as many frames.
    pub fn translate(&mut self) -> Result<Value> {
        let settings: Settings = serde_json::from_slice(&self.text)?;
        let database = self.database.context("there is no database")?;
        let input = self.input.as_ref().context("there is no clip")?;
        let request = settings.request(&database)?;
        let streamed = translate(&database, input, &request, &mut ())?;
        let output = input.output(&streamed);
        self.data = places(&input.upright(&output));
        let body = input.body(&streamed, output.rate_hz);
        self.data.extend(places(&body));
        let mut answer = figures(&streamed);
        answer["output_frames"] = json!(output.frames.len());
        answer["output_rate"] = json!(output.rate_hz);
        answer["body_parents"] = json!(body.skeleton.parents);
        answer["degraded_words"] = json!(degraded_words(&answer));
        let mut verdict = Verdict::of(&database, input, &request, &streamed);
        verdict.note_same_style(&database, &request);
        answer["verdict"] = verdict.json();
        self.streamed = Some(streamed);
        Ok(answer)
    }

    /// Unpacks the views of the glTF file in the data, whose name is in the text, for those who draw its meshes; the data is
    /// the file without packing.
    pub fn unpacked(&mut self) -> Result<Value> {
        let Named { name } = serde_json::from_slice(&self.text)?;
        self.data = gltf::unpacked(&std::mem::take(&mut self.data), &name)?;
        Ok(json!({ "name": name }))
    }

    /// Writes the output, in the form of the input's file. Answers with its name; the data is the file.
    pub fn file(&mut self) -> Result<Value> {
        let (Some(input), Some(streamed)) = (&self.input, &self.streamed) else {
            bail!("there is no output")
        };
        let path = Path::new(&self.file);
        self.data = input.written(&input.output(streamed), path, None)?;
        Ok(json!({ "name": self.file }))
    }
}

/// The joints' places in each frame, metres, single precision.
fn places(clip: &Clip) -> Vec<u8> {
    let places = clip.frames.iter().flat_map(|frame| frame.positions(&clip.skeleton));
    places.flat_map(|p| [p.x as f32, p.y as f32, p.z as f32]).flat_map(f32::to_le_bytes).collect()
}
