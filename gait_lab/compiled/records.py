"""Records spelled out for mypyc, which knows a class of numbers better than a named tuple.

In the source a record is a `NamedTuple`: short to read, safe from changes. Compiled it would remain
a tuple of boxed numbers whose fields are looked up by name. As a class with an `__init__` its
numbers lie in a C struct. So the copy of the source that is compiled has

    class Segment(NamedTuple):              @final
        \"\"\"A piece of motion.\"\"\"      ->   class Segment:
                                                def __init__(self, duration: float, ...): ...
        duration: float                         duration: float

What only tuples can do (unpacking, indices, `_replace`) is then a type error of the compilation.
Every line keeps its number, for the sake of tracebacks.
"""

import ast

from nao_lipm_gait.errors import NaoGaitError

_RECORD = "NamedTuple"


def spelled_out(source: str, name: str = "source") -> str:
    """A module's source with its records as classes; name: of the module, for errors."""
    lines = source.split("\n")
    nodes = list(ast.walk(ast.parse(source)))
    records = [each for each in nodes if isinstance(each, ast.ClassDef) and _is_record(each)]
    for record in records:
        _spell_out(record, lines, name)
    if records:
        imports = [each for each in nodes if isinstance(each, ast.ImportFrom)]
        row = next(each.lineno for each in imports if each.module == "typing") - 1
        lines[row] = lines[row].replace("import ", "import final, ", 1)
    return "\n".join(lines)


def _is_record(node: ast.ClassDef) -> bool:
    return any(isinstance(base, ast.Name) and base.id == _RECORD for base in node.bases)


def _spell_out(node: ast.ClassDef, lines: list[str], name: str) -> None:
    docstring, above = node.body[0], node.lineno - 2
    fields = [each for each in node.body if isinstance(each, ast.AnnAssign)]
    one_line = f"class {node.name}({_RECORD}):" == lines[above + 1].strip()
    one_line = one_line and all(each.lineno == each.end_lineno for each in fields)
    if not one_line or ast.get_docstring(node) is None or lines[above].strip():
        allowed = "a class with a blank line above it, a docstring, and each field in one line"
        raise NaoGaitError(f"{name}: record {node.name}", "something else", allowed)
    lines[above] = "@final"
    lines[above + 1] = f"class {node.name}:"
    for row in range(docstring.lineno - 1, docstring.end_lineno or docstring.lineno):
        lines[row] = ""
    lines[docstring.lineno - 1] = " " * docstring.col_offset + _init(fields)
    for field in fields:
        if field.value is not None:
            # A default belongs to the argument; the class would set it once more.
            row = field.lineno - 1
            kept = lines[row].encode()[: field.annotation.end_col_offset]  # ast counts bytes
            lines[row] = kept.decode()


def _init(fields: list[ast.AnnAssign]) -> str:
    """`__init__` in one line."""
    arguments, assignments = ["self"], []
    for field in fields:
        each = ast.unparse(field.target)
        default = "" if field.value is None else f" = {ast.unparse(field.value)}"
        arguments.append(f"{each}: {ast.unparse(field.annotation)}{default}")
        assignments.append(f"self.{each} = {each}")
    return f"def __init__({', '.join(arguments)}) -> None: {'; '.join(assignments)}"
