//! What a medium holds when the power fails after some steps.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use super::dice::Dice;
use super::recorder::{FileId, Step};

/// What may not be on the medium yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loss {
    /// Nothing that was not synced is there.
    All,
    /// Everything is there, as after `kill -9`.
    Nothing,
    /// Some writes are there and others not, the last of a file torn; of each folder's
    /// changes some of the last are missing.
    Some(u64),
}

/// Folders and files by number, so that renaming one moves all that is in it.
#[derive(Debug, Clone)]
pub(crate) struct Medium<'a> {
    root: &'a Path,
    folders: Vec<Folder>,
    files: Vec<File<'a>>,
    /// The file of each opening: one that is opened again has several.
    opened: BTreeMap<FileId, usize>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Node {
    Folder(usize),
    File(usize),
}

type Names = BTreeMap<String, Node>;

#[derive(Debug, Clone, Default)]
struct Folder {
    /// As running programs see it.
    seen: Names,
    synced: Names,
    /// From what is synced to what is seen.
    changes: Vec<Change>,
}

#[derive(Debug, Clone)]
enum Change {
    Add(String, Node),
    Move(String, String),
    Remove(String),
}

#[derive(Debug, Clone, Default)]
struct File<'a> {
    synced: Vec<u8>,
    changes: Vec<&'a Step>,
}

fn change_names(names: &mut Names, change: &Change) {
    match change {
        Change::Add(name, node) => {
            names.insert(name.clone(), *node);
        }
        Change::Move(from, to) => {
            if let Some(node) = names.remove(from) {
                names.insert(to.clone(), node);
            }
        }
        Change::Remove(name) => {
            names.remove(name);
        }
    }
}

/// Writes the first `kept` bytes of what a step wrote.
fn change_bytes(content: &mut Vec<u8>, step: &Step, kept: usize) {
    match step {
        Step::Write { offset, bytes, .. } => {
            let (start, bytes) = (*offset as usize, &bytes[..kept.min(bytes.len())]);
            if content.len() < start + bytes.len() {
                content.resize(start + bytes.len(), 0);
            }
            content[start..start + bytes.len()].copy_from_slice(bytes);
        }
        Step::SetLen { bytes, .. } => content.resize(*bytes as usize, 0),
        other => panic!("{other:?} changes no file"),
    }
}

impl<'a> Medium<'a> {
    /// An empty folder.
    pub(crate) fn new(root: &'a Path) -> Self {
        Self {
            root,
            folders: vec![Folder::default()],
            files: Vec::new(),
            opened: BTreeMap::new(),
        }
    }

    /// A folder that holds what is there now, and for good.
    pub(crate) fn of(root: &'a Path) -> Self {
        let mut medium = Self::new(root);
        medium.load(0, root);
        medium
    }

    fn load(&mut self, folder: usize, place: &Path) {
        for entry in fs::read_dir(place).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            let node = if path.is_dir() {
                self.folders.push(Folder::default());
                let made = self.folders.len() - 1;
                self.load(made, &path);
                Node::Folder(made)
            } else {
                self.files.push(File {
                    synced: fs::read(&path).unwrap(),
                    changes: Vec::new(),
                });
                Node::File(self.files.len() - 1)
            };
            let folder = &mut self.folders[folder];
            folder.seen.insert(name.clone(), node);
            folder.synced.insert(name, node);
        }
    }

    /// The folder of a path, and the name in it.
    fn find(&self, path: &Path) -> (usize, String) {
        let folder = self.folder(path.parent().unwrap());
        let name = path.file_name().unwrap().to_str().unwrap();
        (folder, name.to_owned())
    }

    fn folder(&self, path: &Path) -> usize {
        let inside = path.strip_prefix(self.root).unwrap();
        inside.iter().fold(0, |folder, name| {
            match self.folders[folder].seen.get(name.to_str().unwrap()) {
                Some(Node::Folder(next)) => *next,
                other => panic!("{} in {}: {other:?}", name.display(), path.display()),
            }
        })
    }

    fn change(&mut self, folder: usize, change: Change) {
        let folder = &mut self.folders[folder];
        change_names(&mut folder.seen, &change);
        folder.changes.push(change);
    }

    /// Takes the next step.
    pub(crate) fn step(&mut self, step: &'a Step) {
        match step {
            Step::Open { path, file } => {
                let (folder, name) = self.find(path);
                let found = match self.folders[folder].seen.get(&name) {
                    Some(Node::File(found)) => *found,
                    Some(Node::Folder(_)) => panic!("{} is a folder", path.display()),
                    None => {
                        self.files.push(File::default());
                        let made = self.files.len() - 1;
                        self.change(folder, Change::Add(name, Node::File(made)));
                        made
                    }
                };
                self.opened.insert(*file, found);
            }
            Step::Write { file, .. } | Step::SetLen { file, .. } => {
                self.files[self.opened[file]].changes.push(step);
            }
            Step::SyncFile { file } => {
                let file = &mut self.files[self.opened[file]];
                for change in file.changes.drain(..) {
                    change_bytes(&mut file.synced, change, usize::MAX);
                }
            }
            Step::CreateDir { path } => {
                let (folder, name) = self.find(path);
                self.folders.push(Folder::default());
                let made = Node::Folder(self.folders.len() - 1);
                self.change(folder, Change::Add(name, made));
            }
            Step::Rename { from, to } => {
                let ((folder, from), (other, to)) = (self.find(from), self.find(to));
                assert_eq!(folder, other, "only renames within a folder are safe");
                self.change(folder, Change::Move(from, to));
            }
            Step::Remove { path } => {
                let (folder, name) = self.find(path);
                self.change(folder, Change::Remove(name));
            }
            Step::SyncDir { path } => {
                let folder = self.folder(path);
                let folder = &mut self.folders[folder];
                for change in folder.changes.drain(..) {
                    change_names(&mut folder.synced, &change);
                }
            }
            Step::Told(_) => {}
        }
    }

    /// Writes what is there after the power failed into an empty folder.
    pub(crate) fn write_survivors(&self, loss: Loss, target: &Path) {
        let mut dice = match loss {
            Loss::Some(seed) => Dice::new(seed),
            _ => Dice::new(0),
        };
        self.write_folder(0, loss, &mut dice, target);
    }

    fn write_folder(&self, folder: usize, loss: Loss, dice: &mut Dice, target: &Path) {
        let folder = &self.folders[folder];
        let count = folder.changes.len();
        let survive = match loss {
            Loss::All => 0,
            Loss::Nothing => count,
            Loss::Some(_) => dice.below(count as u64 + 1) as usize,
        };
        let mut names = folder.synced.clone();
        for change in &folder.changes[..survive] {
            change_names(&mut names, change);
        }
        for (name, node) in names {
            let path = target.join(name);
            match node {
                Node::Folder(number) => {
                    fs::create_dir(&path).unwrap();
                    self.write_folder(number, loss, dice, &path);
                }
                Node::File(number) => {
                    fs::write(&path, self.content(number, loss, dice)).unwrap();
                }
            }
        }
    }

    fn content(&self, file: usize, loss: Loss, dice: &mut Dice) -> Vec<u8> {
        let file = &self.files[file];
        let mut content = file.synced.clone();
        for (index, change) in file.changes.iter().enumerate() {
            let last = index + 1 == file.changes.len();
            let kept = match loss {
                Loss::All => None,
                Loss::Nothing => Some(usize::MAX),
                Loss::Some(_) => match (dice.below(3), change) {
                    (0, _) => None,
                    (1, Step::Write { bytes, .. }) if last || dice.below(4) == 0 => {
                        Some(dice.below(bytes.len() as u64 + 1) as usize)
                    }
                    _ => Some(usize::MAX),
                },
            };
            if let Some(kept) = kept {
                change_bytes(&mut content, change, kept);
            }
        }
        content
    }
}
