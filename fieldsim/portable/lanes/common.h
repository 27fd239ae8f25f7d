// What every translated function may use. Masks are all ones in a lane or all zeros: joined by &, |, ^ and ~.
struct Table {
    const scalar* data;
    int stride;
    scalar operator()(int row, int column) const { return data[(long long)stride * row + column]; }
};
// A table for each lane: the numbers of all lanes lie side by side.
struct Tables {
    const scalar* data;
    int stride, step;
    Real operator()(int row, int column) const
    {
        Real r;
        __builtin_memcpy(&r, data + (long long)stride * row + (long long)step * column, sizeof r);
        return r;
    }
};
struct Indices {
    const int* data;
    int operator()(int place) const { return data[place]; }
};
static bool any(Mask m) { return __builtin_reduce_or(m) != 0; }
static Mask spread(bool b) { return b ? Mask(-1) : Mask(0); }
static Real gather(Table table, Int row, Int column, Mask live)
{
    const Int place = live ? row * table.stride + column : Int(0);
    Real r;
    for (int k = 0; k < WIDTH; ++k) r[k] = table.data[place[k]];
    return r;
}
static Real gather(Tables tables, Int row, Int column, Mask live)
{
    const Int place = live ? row * tables.stride + column * tables.step : Int(0);
    Real r;
    for (int k = 0; k < WIDTH; ++k) r[k] = tables.data[place[k] + k];
    return r;
}
static Int gather(Indices indices, Int place, Mask live)
{
    const Int at = live ? place : Int(0);
    Int r;
    for (int k = 0; k < WIDTH; ++k) r[k] = indices.data[at[k]];
    return r;
}
static Real to_real(Int k) { return __builtin_convertvector(__builtin_convertvector(k, Int32), Real); }
static Int to_int(Real x) { return __builtin_convertvector(__builtin_convertvector(x, Int32), Int); }
static Int as_int(Mask m) { return m & 1; }
static Real abs(Real x) { return __builtin_elementwise_abs(x); }
static scalar abs(scalar x) { return __builtin_elementwise_abs(x); }
static Int abs(Int k) { return k < 0 ? -k : k; }
static int abs(int k) { return k < 0 ? -k : k; }
static Real min(Real x, Real y) { return x != x ? y : (y < x ? y : x); }
static Real max(Real x, Real y) { return x != x ? y : (y > x ? y : x); }
static scalar min(scalar x, scalar y) { return x != x ? y : (y < x ? y : x); }
static scalar max(scalar x, scalar y) { return x != x ? y : (y > x ? y : x); }
static Int min(Int a, Int b) { return a < b ? a : b; }
static Int max(Int a, Int b) { return a > b ? a : b; }
static int min(int a, int b) { return a < b ? a : b; }
static int max(int a, int b) { return a > b ? a : b; }
static Real sqrt(Real x) { return __builtin_elementwise_sqrt(x); }
static scalar sqrt(scalar x) { return __builtin_elementwise_sqrt(x); }
static Real floor(Real x) { return __builtin_elementwise_floor(x); }
static scalar floor(scalar x) { return __builtin_elementwise_floor(x); }
static Real ceil(Real x) { return __builtin_elementwise_ceil(x); }
static scalar ceil(scalar x) { return __builtin_elementwise_ceil(x); }
static Real trunc(Real x) { return __builtin_elementwise_trunc(x); }
static scalar trunc(scalar x) { return __builtin_elementwise_trunc(x); }
static Real copysign(Real x, Real y) { return __builtin_elementwise_copysign(x, y); }
static scalar copysign(scalar x, scalar y) { return __builtin_elementwise_copysign(x, y); }
static Mask isnan(Real x) { return x != x; }
static bool isnan(scalar x) { return x != x; }
static Mask isinf(Real x) { return abs(x) == (scalar)__builtin_inf(); }
static bool isinf(scalar x) { return abs(x) == (scalar)__builtin_inf(); }
static Mask isfinite(Real x) { return abs(x) < (scalar)__builtin_inf(); }
static bool isfinite(scalar x) { return abs(x) < (scalar)__builtin_inf(); }
static Real degrees(Real x) { return x * (scalar)57.29577951308232; }
static scalar degrees(scalar x) { return x * (scalar)57.29577951308232; }
static Real radians(Real x) { return x * (scalar)0.017453292519943295; }
static scalar radians(scalar x) { return x * (scalar)0.017453292519943295; }
