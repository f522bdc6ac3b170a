//! Options of `solve-field` that are known and do nothing here.

use clap::{Arg, ArgAction, ArgMatches, Args, Command, Error, FromArgMatches};

/// Options without a value that ask for what is done anyway.
const MET: [(Option<char>, &str); 11] = [
    (Some('p'), "no-plots"),
    (Some('y'), "no-verify"),
    (Some('G'), "use-wget"),
    (Some('7'), "no-delete-temp"),
    (Some('v'), "verbose"),
    (Some('g'), "guess-scale"),
    (Some('2'), "no-fits2fits"),
    (None, "batch"),
    (None, "fits-image"),
    (None, "crpix-center"),
    (None, "timestamp"),
];

/// Others without a value.
const FLAGS: [(Option<char>, &str); 11] = [
    (Some('r'), "resort"),
    (Some('9'), "no-remove-lines"),
    (Some('A'), "dont-augment"),
    (None, "just-augment"),
    (None, "use-source-extractor"),
    (None, "use-sextractor"),
    (None, "invert"),
    (None, "no-background-subtraction"),
    (None, "no-verify-uniformize"),
    (None, "no-verify-dedup"),
    (None, "tag-all"),
];

/// Others with a value.
const VALUES: [(Option<char>, &str); 41] = [
    (Some('b'), "backend-config"),
    (None, "config"),
    (None, "index-dir"),
    (None, "index-file"),
    (None, "plot-scale"),
    (None, "plot-bg"),
    (Some('Z'), "kmz"),
    (Some('i'), "scamp"),
    (Some('n'), "scamp-config"),
    (Some('j'), "scamp-ref"),
    (Some('8'), "parity"),
    (Some('c'), "code-tolerance"),
    (Some('E'), "pixel-error"),
    (Some('q'), "quad-size-min"),
    (Some('Q'), "quad-size-max"),
    (None, "odds-to-tune-up"),
    (None, "odds-to-solve"),
    (None, "odds-to-reject"),
    (None, "odds-to-stop-looking"),
    (None, "source-extractor-config"),
    (None, "source-extractor-path"),
    (None, "sextractor-config"),
    (None, "sextractor-path"),
    (Some('d'), "depth"),
    (None, "objs"),
    (Some('6'), "extension"),
    (Some('z'), "downsample"),
    (None, "sigma"),
    (None, "uniformize"),
    (Some('C'), "cancel"),
    (None, "sort-rdls"),
    (None, "tag"),
    (Some('P'), "pnm"),
    (Some('V'), "verify"),
    (None, "verify-ext"),
    (None, "crpix-x"),
    (None, "crpix-y"),
    (None, "predistort"),
    (None, "xscale"),
    (Some('m'), "temp-dir"),
    (Some('F'), "fields"),
];

/// Those of them that are given.
#[derive(Debug)]
pub(super) struct WithoutEffect(Vec<&'static str>);

impl WithoutEffect {
    /// Those that ask for what is not done, for people; `None` where there are none.
    pub(super) fn named(&self) -> Option<String> {
        let named: Vec<String> = self.0.iter().map(|name| format!("--{name}")).collect();
        (!named.is_empty()).then(|| named.join(", "))
    }
}

impl Args for WithoutEffect {
    fn augment_args(command: Command) -> Command {
        let arg = |(short, name): (Option<char>, &'static str)| {
            let arg = Arg::new(name).long(name).hide(true);
            match short {
                Some(short) => arg.short(short),
                None => arg,
            }
        };
        let flags = MET.into_iter().chain(FLAGS);
        let flags = flags.map(|named| arg(named).action(ArgAction::Count));
        let values = VALUES.into_iter();
        let values = values.map(|named| {
            arg(named)
                .action(ArgAction::Append)
                .allow_hyphen_values(true)
        });
        command.args(flags.chain(values))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for WithoutEffect {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let flags = FLAGS
            .into_iter()
            .filter(|(_, name)| matches.get_count(name) > 0);
        let values = VALUES
            .into_iter()
            .filter(|(_, name)| matches.contains_id(name));
        Ok(Self(flags.chain(values).map(|(_, name)| name).collect()))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
