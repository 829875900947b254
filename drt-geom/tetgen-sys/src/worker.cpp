// A program that makes tetrahedra with TetGen: one request on standard input, the answer on
// standard output, both of 8-byte words first and arrays after, in the machine's own byte order.
//
//   request: points, triangles, seconds it may take; 3 doubles per point; 3 uint32 per triangle
//   answer:  points, tetrahedra; 3 doubles per point; 4 int32 per tetrahedron
//
// It never returns from an error: whatever goes wrong ends the process, with the exit codes below.
// Every index and coordinate was checked by who wrote the request.

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <vector>

// The library calls this function for every error. Its own version frees the mesh and throws, on
// which the mesh is freed again and the process crashes. The linker lets ours take its place.
#define terminatetetgen terminatetetgen_of_the_library
#include <tetgen.h>
#undef terminatetetgen

namespace {

enum ExitCode { kNoRequest = 32, kNoAnswer = 33, kNoMemory = 34, kRefused = 64 };

void ReadAll(void *to, size_t size) {
  char *at = static_cast<char *>(to);
  while (size > 0) {
    ssize_t n = read(STDIN_FILENO, at, size);
    if (n <= 0) _exit(kNoRequest);
    at += n;
    size -= static_cast<size_t>(n);
  }
}

void WriteAll(int file, const void *from, size_t size) {
  const char *at = static_cast<const char *>(from);
  while (size > 0) {
    ssize_t n = write(file, at, size);
    if (n <= 0) _exit(kNoAnswer);
    at += n;
    size -= static_cast<size_t>(n);
  }
}

// The library prints, even when told to be quiet; the answer must not be among it.
int TakeOutput() {
  int answer = dup(STDOUT_FILENO);
  int nowhere = open("/dev/null", O_WRONLY);
  if (answer < 0 || nowhere < 0 || dup2(nowhere, STDOUT_FILENO) < 0 ||
      dup2(nowhere, STDERR_FILENO) < 0)
    _exit(kNoAnswer);
  return answer;
}

}  // namespace

void terminatetetgen(tetgenmesh *, int code) { _exit(kRefused + code); }

int main() {
  int answer = TakeOutput();
  rlimit no_core = {0, 0};
  setrlimit(RLIMIT_CORE, &no_core);
  std::set_new_handler([] { _exit(kNoMemory); });

  uint64_t request[3];
  ReadAll(request, sizeof request);
  const uint64_t points = request[0], triangles = request[1];
  // Should the caller die, nobody else ends this.
  alarm(static_cast<unsigned>(request[2]));

  // The library's structures own what they point to. These never are destroyed.
  tetgenio &in = *new tetgenio, &out = *new tetgenio;
  in.numberofpoints = static_cast<int>(points);
  in.pointlist = new REAL[3 * points];
  ReadAll(in.pointlist, 3 * points * sizeof(REAL));

  std::vector<int> corners(3 * triangles);
  ReadAll(corners.data(), 3 * triangles * sizeof(int));
  std::vector<tetgenio::polygon> polygons(triangles);
  in.numberoffacets = static_cast<int>(triangles);
  in.facetlist = new tetgenio::facet[triangles];
  for (uint64_t i = 0; i < triangles; ++i) {
    polygons[i].vertexlist = &corners[3 * i];
    polygons[i].numberofvertices = 3;
    tetgenio::init(&in.facetlist[i]);
    in.facetlist[i].polygonlist = &polygons[i];
    in.facetlist[i].numberofpolygons = 1;
  }

  // p: the triangles are faces of the result; Y: without points added on them; z: count from 0.
  char switches[] = "pYzQ";
  tetrahedralize(switches, &in, &out);

  const uint64_t counts[2] = {static_cast<uint64_t>(out.numberofpoints),
                              static_cast<uint64_t>(out.numberoftetrahedra)};
  WriteAll(answer, counts, sizeof counts);
  WriteAll(answer, out.pointlist, 3 * counts[0] * sizeof(REAL));
  WriteAll(answer, out.tetrahedronlist, 4 * counts[1] * sizeof(int));
  _exit(0);
}
