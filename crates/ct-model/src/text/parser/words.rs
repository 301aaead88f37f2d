//! Reserved words of Modelica, and words outside the subset.

/// Words of Modelica that are no names.
pub(super) const KEYWORDS: [&str; 58] = [
    "algorithm",
    "and",
    "annotation",
    "block",
    "break",
    "class",
    "connect",
    "connector",
    "constant",
    "constrainedby",
    "der",
    "discrete",
    "each",
    "else",
    "elseif",
    "elsewhen",
    "encapsulated",
    "end",
    "enumeration",
    "equation",
    "expandable",
    "extends",
    "external",
    "false",
    "final",
    "flow",
    "for",
    "function",
    "if",
    "import",
    "impure",
    "in",
    "initial",
    "inner",
    "input",
    "loop",
    "model",
    "not",
    "operator",
    "or",
    "outer",
    "output",
    "package",
    "parameter",
    "partial",
    "protected",
    "public",
    "pure",
    "record",
    "redeclare",
    "replaceable",
    "return",
    "stream",
    "then",
    "true",
    "type",
    "when",
    "within",
];

/// Words outside the subset, with the correction.
pub(super) fn outside(word: &str) -> Option<&'static str> {
    Some(match word {
        "connect" => "connections are not supported: write the equations that it stands for",
        "when" | "elsewhen" => "`when` is not supported: write an expression with `if` or `time`",
        "for" | "while" | "loop" => "loops are not supported: write every equation",
        "algorithm" => "algorithms are not supported: write equations under `equation`",
        "initial" => "`equation` has to follow it: write `initial equation`",
        "extends" | "import" | "within" | "redeclare" | "replaceable" | "constrainedby" => {
            "a model is a single text: write into it the parts that it takes from other models"
        }
        "package" | "block" | "class" | "record" | "connector" | "function" | "type"
        | "partial" | "encapsulated" | "expandable" | "operator" | "external" => {
            "a text is one `model`: write its variables and equations there"
        }
        "Integer" | "Boolean" | "String" | "enumeration" | "discrete" => {
            "every variable is a `Real`"
        }
        "annotation" => "annotations are not supported: delete it",
        "protected" | "public" | "inner" | "outer" | "flow" | "stream" | "each" => {
            "it has no meaning in a single model: delete the word"
        }
        "assert" | "terminate" | "reinit" => {
            "it does not compute a variable: delete it, or write bounds with min and max"
        }
        _ => return None,
    })
}
