/* Times a map's emitted kernels on a graphics processor and checks them against the same text on the processor.
 *
 * benches/gpu/run compiles it for a scene: MAP is the emitted file, NAME and UPPER the scene's name, REAL the map's numbers.
 * Floors are measured in the same run: multiply-adds of a loop of nothing else, and bytes of a copy. Exit code 1: an image or a
 * contact differs by more than rounding.
 * usage: chart [points a side of the chart] [file.ppm]
 */
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <vector>

#include MAP

#define PASTE(a, b) a##b
#define JOIN(a, b) PASTE(a, b)
#define OWN(item) JOIN(NAME, item)
#define CONSTANT(item) JOIN(UPPER, item)

namespace {

constexpr int DIMENSION = CONSTANT(_DIMENSION);
constexpr int PARAMETERS = CONSTANT(_PARAMETERS);
constexpr int PASSAGES = CONSTANT(_PASSAGES);
static_assert(PARAMETERS >= 2, "a chart has two parameters");
using Attractor = OWN(_attractor);

const REAL WINDOW_STATE[] = CONSTANT(_WINDOW_STATE);
const REAL WINDOW_PARAMETERS[] = CONSTANT(_WINDOW_PARAMETERS);

/* Iterates dropped, and the longest period that is looked for. */
constexpr long long TRANSIENT = 1000;
constexpr int LONGEST = 32;
/* Points of one step; of these, compared with the processor. */
constexpr long long POINTS = 1 << 24;
constexpr long long COMPARED = 1 << 20;
/* Threads of a block. */
constexpr int THREADS = 128;
/* Cells a side of the chart that the processor makes. */
constexpr int SIDE_OF_PROCESSOR = 128;
constexpr long long SIDE_OF_PICTURE = 1024;
/* Independent chains of a thread, and steps of each, in the loop of multiply-adds. */
constexpr int CHAINS = 8;
constexpr int ROUNDS = 4096;

void demand(cudaError_t status)
{
    if (status != cudaSuccess) {
        std::fprintf(stderr, "CUDA: %s\n", cudaGetErrorString(status));
        std::exit(2);
    }
}

template <typename T> class Device {
public:
    explicit Device(size_t count) : count_(count) { demand(cudaMalloc(&memory_, count * sizeof(T))); }
    explicit Device(const std::vector<T> &values) : Device(values.size()) { put(values); }
    Device(const Device &) = delete;
    Device &operator=(const Device &) = delete;
    ~Device() { cudaFree(memory_); }
    T *at() const { return memory_; }
    void put(const std::vector<T> &values)
    {
        demand(cudaMemcpy(memory_, values.data(), count_ * sizeof(T), cudaMemcpyHostToDevice));
    }
    std::vector<T> get() const
    {
        std::vector<T> values(count_);
        demand(cudaMemcpy(values.data(), memory_, count_ * sizeof(T), cudaMemcpyDeviceToHost));
        return values;
    }

private:
    T *memory_ = nullptr;
    size_t count_;
};

unsigned blocks(long long count) { return static_cast<unsigned>((count + THREADS - 1) / THREADS); }

/* Median of the seconds that the device takes, after one run that does not count. */
double seconds(int runs, const std::function<void()> &run)
{
    cudaEvent_t from, to;
    demand(cudaEventCreate(&from));
    demand(cudaEventCreate(&to));
    std::vector<float> times;
    for (int i = 0; i <= runs; i++) {
        float milliseconds;
        demand(cudaEventRecord(from));
        run();
        demand(cudaGetLastError());
        demand(cudaEventRecord(to));
        demand(cudaEventSynchronize(to));
        demand(cudaEventElapsedTime(&milliseconds, from, to));
        if (i > 0) {
            times.push_back(milliseconds);
        }
    }
    demand(cudaEventDestroy(from));
    demand(cudaEventDestroy(to));
    std::sort(times.begin(), times.end());
    return 1e-3 * times[times.size() / 2];
}

__global__ void multiply_add(REAL factor, REAL term, REAL *sums)
{
    REAL chains[CHAINS];
    for (int i = 0; i < CHAINS; i++) {
        chains[i] = term * i;
    }
    for (int round = 0; round < ROUNDS; round++) {
        for (int i = 0; i < CHAINS; i++) {
            chains[i] = fma(chains[i], factor, term);
        }
    }
    REAL sum = 0;
    for (int i = 0; i < CHAINS; i++) {
        sum += chains[i];
    }
    sums[blockIdx.x * blockDim.x + threadIdx.x] = sum;
}

/* Seconds of one multiply-add, all threads together. */
double multiply_add_time()
{
    const int count = 1 << 20;
    Device<REAL> sums(count);
    const double time = seconds(5, [&] { multiply_add<<<blocks(count), THREADS>>>(REAL(0.999), REAL(1e-3), sums.at()); });
    return time / (double(count) * CHAINS * ROUNDS);
}

/* Seconds of one byte read or written by a copy. */
double byte_time()
{
    const size_t bytes = size_t(1) << 30;
    Device<char> from(bytes), to(bytes);
    demand(cudaMemset(from.at(), 1, bytes));
    return seconds(5, [&] { demand(cudaMemcpyAsync(to.at(), from.at(), bytes, cudaMemcpyDeviceToDevice)); }) / (2.0 * bytes);
}

/* Numbers from -1 to 1 in no order, the same in every run. */
class Numbers {
public:
    REAL next()
    {
        state_ = state_ * 6364136223846793005ULL + 1442695040888963407ULL;
        return REAL(double(state_ >> 11) / 4503599627370496.0 - 1.0);
    }

private:
    unsigned long long state_ = 1;
};

/* `count` points in boxes of these half-widths, one coordinate after another. */
std::vector<REAL> points(Numbers &numbers, long long count, int dimension, const REAL *half_widths)
{
    std::vector<REAL> values(count * dimension);
    for (int i = 0; i < dimension; i++) {
        for (long long n = 0; n < count; n++) {
            values[i * count + n] = half_widths[i] * numbers.next();
        }
    }
    return values;
}

/* One step of every point; returns whether it agrees with the processor's. */
bool steps(double byte, double multiply_add)
{
    Numbers numbers;
    const auto states = points(numbers, POINTS, DIMENSION, WINDOW_STATE);
    const auto parameters = points(numbers, POINTS, PARAMETERS, WINDOW_PARAMETERS);
    const Device<REAL> from(states), with(parameters);
    Device<REAL> images(std::vector<REAL>(POINTS * DIMENSION, NAN)), depths(std::vector<REAL>(POINTS * PASSAGES, NAN));
    Device<int> contacts(std::vector<int>(POINTS, -1));
    const double time = seconds(9, [&] {
        OWN(_steps)<<<blocks(POINTS), THREADS>>>(POINTS, from.at(), with.at(), images.at(), depths.at(), contacts.at());
    });
    const auto image = images.get(), depth = depths.get();
    const auto made = contacts.get();
    double largest = 0;
    long long touching = 0, other = 0;
    for (long long n = 0; n < COMPARED; n++) {
        REAL state[DIMENSION], own[PARAMETERS], expected[DIMENSION], deep[PASSAGES];
        for (int i = 0; i < DIMENSION; i++) {
            state[i] = states[i * POINTS + n];
        }
        for (int i = 0; i < PARAMETERS; i++) {
            own[i] = parameters[i * POINTS + n];
        }
        const int expected_contacts = OWN(_step)(state, own, expected, deep);
        touching += expected_contacts > 0;
        other += made[n] != expected_contacts;
        for (int i = 0; i < DIMENSION; i++) {
            const double difference = std::fabs(double(image[i * POINTS + n]) - double(expected[i])) / double(WINDOW_STATE[i]);
            largest = difference <= largest ? largest : difference;
        }
    }
    const double bytes = sizeof(REAL) * double(2 * DIMENSION + PARAMETERS + PASSAGES) + sizeof(int);
    std::printf("  steps: %.1f ps a step, floor %.1f of %.0f bytes and %.1f of %d multiply-adds\n", 1e12 * time / POINTS,
                1e12 * byte * bytes, bytes, 1e12 * multiply_add * STEP_MULTIPLY_ADDS, STEP_MULTIPLY_ADDS);
    std::printf("  compared with the processor: %lld points, %lld with contact, largest difference %.1e of the window, "
                "%lld other contacts\n", COMPARED, touching, largest, other);
    /* A fused product rounds once where the processor's two operations round twice; depths within rounding of 0 may differ. */
    const double rounding = sizeof(REAL) == sizeof(double) ? 1e-10 : 1e-2;
    return largest <= rounding && other <= COMPARED / 10000;
}

/* Parameters of a square grid over the window of the first two, row by row; the others at 0. */
std::vector<REAL> grid(long long side)
{
    const long long count = side * side;
    std::vector<REAL> values(count * PARAMETERS, 0);
    for (long long n = 0; n < count; n++) {
        values[n] = WINDOW_PARAMETERS[0] * REAL(2 * (n % side) + 1 - side) / REAL(side);
        values[count + n] = WINDOW_PARAMETERS[1] * REAL(2 * (n / side) + 1 - side) / REAL(side);
    }
    return values;
}

/* Iterates of a chart: of orbits that escape, those before they left the window. */
double iterates(const std::vector<Attractor> &attractors)
{
    double sum = 0;
    for (const auto &found : attractors) {
        sum += found.period < 0 ? double(found.left) : double(TRANSIENT + (found.period > 0 ? found.period : LONGEST));
    }
    return sum;
}

/* A picture of periods, at most SIDE_OF_PICTURE cells a side: grey without, black where the orbit escapes. */
void draw(const char *file, long long side, const std::vector<Attractor> &attractors)
{
    std::FILE *picture = std::fopen(file, "wb");
    if (picture == nullptr) {
        std::perror(file);
        std::exit(2);
    }
    const long long apart = (side + SIDE_OF_PICTURE - 1) / SIDE_OF_PICTURE, drawn = side / apart;
    std::fprintf(picture, "P6\n%lld %lld\n255\n", drawn, drawn);
    for (long long row = drawn - 1; row >= 0; row--) {
        for (long long column = 0; column < drawn; column++) {
            const auto &found = attractors[(row * side + column) * apart];
            unsigned char colour[3] = {0, 0, 0};
            for (int i = 0; i < 3 && found.period >= 0; i++) {
                const double angle = 2.4 * found.period + 1.3 * found.contacts + 2.1 * i;
                colour[i] = static_cast<unsigned char>(found.period == 0 ? 128 : 150 + 100 * std::sin(angle));
            }
            std::fwrite(colour, 1, sizeof colour, picture);
        }
    }
    std::fclose(picture);
}

/* A chart, and a smaller one beside the processor's. */
void chart(long long side, double multiply_add, const char *file)
{
    const REAL tolerance = WINDOW_STATE[0] * REAL(sizeof(REAL) == sizeof(double) ? 1e-6 : 1e-3);
    const long long count = side * side;
    const Device<REAL> parameters(grid(side));
    Device<REAL> states(std::vector<REAL>(count * DIMENSION, 0));
    Device<Attractor> attractors(count);
    const double time = seconds(5, [&] {
        demand(cudaMemsetAsync(states.at(), 0, count * DIMENSION * sizeof(REAL)));
        OWN(_chart)<<<blocks(count), THREADS>>>(count, states.at(), parameters.at(), TRANSIENT, LONGEST, tolerance,
                                                attractors.at());
    });
    const auto found = attractors.get();
    const double iterate = time / iterates(found);
    const auto escapes = std::count_if(found.begin(), found.end(), [](const Attractor &one) { return one.period < 0; });
    std::printf("  chart %lld x %lld, %lld cells escape: %.2e iterates in %.2f ms: %.2f ps an iterate, floor %.2f of %d multiply-adds\n",
                side, side, static_cast<long long>(escapes), iterates(found), 1e3 * time, 1e12 * iterate,
                1e12 * multiply_add * FROZEN_MULTIPLY_ADDS, FROZEN_MULTIPLY_ADDS);
    if (file != nullptr) {
        draw(file, side, found);
    }
    /* The same text on one core, with a grid of its own on the device to compare with. */
    const long long few = SIDE_OF_PROCESSOR * SIDE_OF_PROCESSOR;
    const auto own = grid(SIDE_OF_PROCESSOR);
    const Device<REAL> same(own);
    demand(cudaMemset(states.at(), 0, few * DIMENSION * sizeof(REAL)));
    OWN(_chart)<<<blocks(few), THREADS>>>(few, states.at(), same.at(), TRANSIENT, LONGEST, tolerance, attractors.at());
    demand(cudaGetLastError());
    auto device = attractors.get();
    device.resize(few);
    std::vector<Attractor> expected(few);
    const auto start = std::chrono::steady_clock::now();
    for (long long n = 0; n < few; n++) {
        REAL state[DIMENSION] = {0}, at[PARAMETERS];
        for (int i = 0; i < PARAMETERS; i++) {
            at[i] = own[i * few + n];
        }
        expected[n] = OWN(_settle)(at, state, TRANSIENT, LONGEST, tolerance);
    }
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    long long periodic = 0, equal = 0;
    for (long long n = 0; n < few; n++) {
        periodic += expected[n].period > 0;
        equal += expected[n].period == device[n].period && expected[n].contacts == device[n].contacts;
    }
    const double of_processor = elapsed.count() / iterates(expected);
    std::printf("  one core, point by point: %.2f ns an iterate, %.0f times as long; %d x %d cells, %lld periodic, %lld alike\n",
                1e9 * of_processor, of_processor / iterate, SIDE_OF_PROCESSOR, SIDE_OF_PROCESSOR, periodic, equal);
}

} // namespace

int main(int count, char **arguments)
{
    const long long side = count > 1 ? std::atoll(arguments[1]) : 4096;
    if (side < SIDE_OF_PROCESSOR) {
        std::fprintf(stderr, "points a side of the chart: %d or more\n", SIDE_OF_PROCESSOR);
        return 2;
    }
    cudaDeviceProp device;
    demand(cudaGetDeviceProperties(&device, 0));
    const double multiply_add = multiply_add_time(), byte = byte_time();
    std::printf("%s in %s on %s, %d multiprocessors: a multiply-add %.4f ps, a copy %.2f TB/s\n", CONSTANT(_SCENE),
                sizeof(REAL) == sizeof(double) ? "f64" : "f32", device.name, device.multiProcessorCount, 1e12 * multiply_add,
                1e-12 / byte);
    const bool agree = steps(byte, multiply_add);
    chart(side, multiply_add, count > 2 ? arguments[2] : nullptr);
    return agree ? 0 : 1;
}
