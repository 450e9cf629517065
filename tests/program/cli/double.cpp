// A double of libcuda and libnvrtc for machines without a graphics processor: the functions that the program calls, no more.
//
// It compiles the very text for this processor and walks through the threads in turn. What is put into a stream is done as late as
// CUDA allows: when something waits for it. A program that reads too early, or writes too early what is still to be copied, gets
// other numbers. DOUBLE_FAILS_AT names a launch, from 1, that fails; DOUBLE_NOTES a file for what was done.
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <dlfcn.h>
#include <functional>
#include <mutex>
#include <set>
#include <string>
#include <unistd.h>
#include <vector>

namespace {

enum { SUCCESS = 0, INVALID_VALUE = 1, INVALID_IMAGE = 200, NOT_FOUND = 500, LAUNCH_FAILED = 719 };
enum { CREATION_FAILED = 1, INVALID_OPTION = 5, COMPILATION_FAILED = 6 };

using Work = std::function<void()>;

std::recursive_mutex order;

struct Stream {
    std::vector<Work> waiting;
};

struct Event {
    Stream *stream = nullptr;
};

std::set<Stream *> busy;
size_t most_busy = 0;
long long launches = 0, points = 0;

int put(Stream *stream, Work work)
{
    std::lock_guard<std::recursive_mutex> guard(order);
    if (stream == nullptr) {
        work();
        return SUCCESS;
    }
    stream->waiting.push_back(std::move(work));
    return SUCCESS;
}

int finish(Stream *stream)
{
    std::vector<Work> waiting;
    {
        std::lock_guard<std::recursive_mutex> guard(order);
        if (stream != nullptr) {
            waiting.swap(stream->waiting);
            busy.erase(stream);
        }
    }
    for (auto &work : waiting) {
        work();
    }
    return SUCCESS;
}

struct Notes {
    ~Notes()
    {
        const char *path = std::getenv("DOUBLE_NOTES");
        std::FILE *file = path != nullptr && launches > 0 ? std::fopen(path, "w") : nullptr;
        if (file != nullptr) {
            std::fprintf(file, "%lld launches of %lld points, %zu streams at once\n", launches, points, most_busy);
            std::fclose(file);
        }
    }
} notes;

struct Program {
    std::string text, library, log;
};

// CUDA's words for a processor, before the text; a walk through the threads after it.
const char *const BEFORE = R"(
#define __CUDACC__
#define __global__
#define __host__
#define __device__
static thread_local struct { unsigned x; } blockIdx, blockDim, threadIdx;
)";
const char *const AFTER = R"(
extern "C" void double_walk(void *kernel, unsigned blocks, unsigned threads, const long long *a)
{
    using Kernel = void (*)(long long, long long, long long, long long, long long, long long, long long, long long);
    blockDim.x = threads;
    for (blockIdx.x = 0; blockIdx.x < blocks; blockIdx.x++) {
        for (threadIdx.x = 0; threadIdx.x < threads; threadIdx.x++) {
            ((Kernel)kernel)(a[0], a[1], a[2], a[3], a[4], a[5], a[6], a[7]);
        }
    }
}
)";
const int ARGUMENTS = 8;

using Walk = void (*)(void *, unsigned, unsigned, const long long *);
struct Function {
    void *kernel;
    Walk walk;
};

} // namespace

extern "C" {

int cuInit(unsigned) { return SUCCESS; }
int cuDeviceGet(int *device, int ordinal)
{
    *device = ordinal;
    return ordinal == 0 ? SUCCESS : INVALID_VALUE;
}
int cuDeviceGetName(char *name, int length, int)
{
    std::snprintf(name, length, "double");
    return SUCCESS;
}
int cuDeviceGetAttribute(int *value, int attribute, int)
{
    // 75, 76: the compute capability; others: no.
    *value = attribute == 75 ? 9 : 0;
    return SUCCESS;
}
int cuDevicePrimaryCtxRetain(void **context, int)
{
    *context = &notes;
    return SUCCESS;
}
int cuDevicePrimaryCtxRelease_v2(int) { return SUCCESS; }
int cuCtxGetCurrent(void **context)
{
    *context = &notes;
    return SUCCESS;
}
int cuCtxSetCurrent(void *) { return SUCCESS; }
int cuCtxSynchronize() { return SUCCESS; }
int cuGetErrorName(int error, const char **words)
{
    *words = error == LAUNCH_FAILED ? "CUDA_ERROR_LAUNCH_FAILED" : "CUDA_ERROR";
    return SUCCESS;
}
int cuGetErrorString(int error, const char **words)
{
    *words = error == LAUNCH_FAILED ? "unspecified launch failure" : "an error";
    return SUCCESS;
}

int cuStreamCreate(Stream **stream, unsigned)
{
    *stream = new Stream;
    return SUCCESS;
}
int cuStreamDestroy_v2(Stream *stream)
{
    // NOTE: events outlive their streams, so that the memory stays.
    return finish(stream);
}
int cuStreamSynchronize(Stream *stream) { return finish(stream); }
int cuStreamWaitEvent(Stream *stream, Event *event, unsigned)
{
    return event->stream != stream ? finish(event->stream) : SUCCESS;
}
int cuEventCreate(Event **event, unsigned)
{
    *event = new Event;
    return SUCCESS;
}
int cuEventDestroy_v2(Event *event)
{
    delete event;
    return SUCCESS;
}
int cuEventRecord(Event *event, Stream *stream)
{
    event->stream = stream;
    return SUCCESS;
}
int cuEventSynchronize(Event *event) { return finish(event->stream); }

int cuMemAlloc_v2(unsigned long long *memory, size_t bytes)
{
    *memory = reinterpret_cast<unsigned long long>(std::malloc(bytes));
    return SUCCESS;
}
int cuMemFree_v2(unsigned long long memory)
{
    std::free(reinterpret_cast<void *>(memory));
    return SUCCESS;
}
int cuMemHostAlloc(void **memory, size_t bytes, unsigned)
{
    *memory = std::malloc(bytes);
    return SUCCESS;
}
int cuMemFreeHost(void *memory)
{
    std::free(memory);
    return SUCCESS;
}
int cuMemcpyHtoDAsync_v2(unsigned long long to, const void *from, size_t bytes, Stream *stream)
{
    return put(stream, [=] { std::memcpy(reinterpret_cast<void *>(to), from, bytes); });
}
int cuMemcpyDtoHAsync_v2(void *to, unsigned long long from, size_t bytes, Stream *stream)
{
    return put(stream, [=] { std::memcpy(to, reinterpret_cast<void *>(from), bytes); });
}
int cuMemsetD8Async(unsigned long long to, unsigned char value, size_t bytes, Stream *stream)
{
    return put(stream, [=] { std::memset(reinterpret_cast<void *>(to), value, bytes); });
}

// An image is the path of a library.
int cuModuleLoadData(void **module, const void *image)
{
    *module = dlopen(static_cast<const char *>(image), RTLD_NOW | RTLD_LOCAL);
    return *module != nullptr ? SUCCESS : INVALID_IMAGE;
}
int cuModuleUnload(void *) { return SUCCESS; }
int cuModuleGetFunction(Function **function, void *module, const char *name)
{
    *function = new Function{dlsym(module, name), reinterpret_cast<Walk>(dlsym(module, "double_walk"))};
    return (*function)->kernel != nullptr ? SUCCESS : NOT_FOUND;
}
int cuLaunchKernel(Function *function, unsigned blocks, unsigned, unsigned, unsigned threads, unsigned, unsigned, unsigned,
                   Stream *stream, void **parameters, void **)
{
    std::vector<long long> values(ARGUMENTS);
    for (int i = 0; i < ARGUMENTS; i++) {
        std::memcpy(&values[i], parameters[i], sizeof(long long));
    }
    {
        std::lock_guard<std::recursive_mutex> guard(order);
        const char *fails = std::getenv("DOUBLE_FAILS_AT");
        launches++;
        points += values[0];
        busy.insert(stream);
        most_busy = busy.size() > most_busy ? busy.size() : most_busy;
        if (fails != nullptr && std::atoll(fails) == launches) {
            return LAUNCH_FAILED;
        }
    }
    return put(stream, [=] { function->walk(function->kernel, blocks, threads, values.data()); });
}

int nvrtcCreateProgram(Program **program, const char *text, const char *, int, const char *const *, const char *const *)
{
    *program = new Program;
    (*program)->text = text;
    return SUCCESS;
}
int nvrtcDestroyProgram(Program **program)
{
    delete *program;
    return SUCCESS;
}
int nvrtcCompileProgram(Program *program, int count, const char *const *options)
{
    char folder[] = "/tmp/grazemap-double-XXXXXX";
    std::string defines;
    bool apart = false;
    for (int i = 0; i < count; i++) {
        const std::string option = options[i], define = "--define-macro=";
        if (option.compare(0, define.size(), define) == 0) {
            defines += " -D" + option.substr(define.size());
        }
        apart = apart || option == "--fmad=false";
        // As a compiler that is older than the device.
        if (option == "--gpu-architecture=compute_90") {
            return INVALID_OPTION;
        }
    }
    if (!apart || mkdtemp(folder) == nullptr) {
        return CREATION_FAILED;
    }
    const std::string stem = std::string(folder) + "/kernel";
    std::FILE *source = std::fopen((stem + ".cpp").c_str(), "w");
    if (source == nullptr) {
        return CREATION_FAILED;
    }
    std::fprintf(source, "%s%s%s", BEFORE, program->text.c_str(), AFTER);
    std::fclose(source);
    const std::string command = "c++ -std=c++17 -O2 -ffp-contract=off -fPIC -shared" + defines + " -o " + stem + ".so " + stem +
                                ".cpp 2>" + stem + ".log";
    const int status = std::system(command.c_str());
    std::FILE *said = std::fopen((stem + ".log").c_str(), "r");
    for (int c; said != nullptr && (c = std::fgetc(said)) != EOF;) {
        program->log += static_cast<char>(c);
    }
    if (said != nullptr) {
        std::fclose(said);
    }
    program->library = stem + ".so";
    return status == 0 ? 0 : COMPILATION_FAILED;
}
int nvrtcGetPTXSize(Program *program, size_t *size)
{
    *size = program->library.size() + 1;
    return SUCCESS;
}
int nvrtcGetPTX(Program *program, char *image)
{
    std::memcpy(image, program->library.c_str(), program->library.size() + 1);
    return SUCCESS;
}
int nvrtcGetProgramLogSize(Program *program, size_t *size)
{
    *size = program->log.size() + 1;
    return SUCCESS;
}
int nvrtcGetProgramLog(Program *program, char *log)
{
    std::memcpy(log, program->log.c_str(), program->log.size() + 1);
    return SUCCESS;
}

} // extern "C"
