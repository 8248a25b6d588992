"""The definitions that lie beside the data of a log."""

from imc.lsf.gzip_members import compress_member
from imc.schema import Schema, builtin, builtin_xml_gz, dump

KEPT = "packed"


def gzip_schema(schema: Schema) -> bytes:
    """The schema as IMC.xml.gz; of the built-in one, the file beside the definitions. Others are packed once."""
    if schema is builtin():
        return builtin_xml_gz()
    beside = vars(schema)  # where its cached properties are; schemas that are equal may have other descriptions
    if KEPT not in beside:
        beside[KEPT] = compress_member(dump(schema), level=9)
    return beside[KEPT]
