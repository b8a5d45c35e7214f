"""Archives by another program (Python's zipfile), for tests/archive.rs: run here, writes plain.zip and zip64.zip."""

import zipfile

TEXT = b"expected by the test\n" * 20


def write(name):
    with zipfile.ZipFile(name, "w") as archive:
        for path, method in [
            ("stored.txt", zipfile.ZIP_STORED),
            ("deep/er/deflated.txt", zipfile.ZIP_DEFLATED),
        ]:
            entry = zipfile.ZipInfo(path, (2024, 1, 1, 0, 0, 0))
            entry.compress_type = method
            with archive.open(entry, "w", force_zip64=name == "zip64.zip") as file:
                file.write(TEXT)
        archive.comment = b"a comment behind the directory"


write("plain.zip")
# Makes zipfile write sizes, offsets and counts in the 64-bit records.
zipfile.ZIP64_LIMIT = 10
zipfile.ZIP_FILECOUNT_LIMIT = 0
write("zip64.zip")
