// Moves vectors between lanes and Warp's arrays, `count` lanes of WIDTH from the place `first` on; those beyond it
// repeat the last. Where arrays are whole, vectors go as they are.
struct moves {
typedef lanes::Real Real;
typedef lanes::Int Int;
typedef lanes::scalar scalar;
typedef wp::vec_t<3, scalar> Point;
typedef wp::mat_t<3, 3, scalar> Matrix;
static int within(int k, int count) { return k < count ? k : count - 1; }
static Real load(const wp::array_t<scalar>& from, int first, int count)
{
    Real r;
    for (int k = 0; k < WIDTH; ++k) r[k] = wp::index(from, first + within(k, count));
    return r;
}
static Int load(const wp::array_t<int>& from, int first, int count)
{
    Int r;
    for (int k = 0; k < WIDTH; ++k) r[k] = wp::index(from, first + within(k, count));
    return r;
}
static void load(const wp::array_t<Point>& from, int first, int count, Real& x, Real& y, Real& z)
{
    scalar held[3 * WIDTH];
    const scalar* p = (const scalar*)(from.data + first);
    if (count < WIDTH || from.strides[0] != sizeof(Point)) {
        for (int k = 0; k < WIDTH; ++k) __builtin_memcpy(held + 3 * k, &wp::index(from, first + within(k, count)), sizeof(Point));
        p = held;
    }
    Real a, b, c;
    __builtin_memcpy(&a, p, sizeof(a));
    __builtin_memcpy(&b, p + WIDTH, sizeof(b));
    __builtin_memcpy(&c, p + 2 * WIDTH, sizeof(c));
    UNZIPPED
}
static void store(const wp::array_t<scalar>& to, int first, int count, Real r)
{
    if (count == WIDTH && to.strides[0] == sizeof(scalar)) {
        __builtin_memcpy(to.data + first, &r, sizeof(r));
        return;
    }
    for (int k = 0; k < count; ++k) wp::index(to, first + k) = r[k];
}
static void store(const wp::array_t<Point>& to, int first, int count, Real x, Real y, Real z)
{
    ZIPPED
    if (count == WIDTH && to.strides[0] == sizeof(Point)) {
        scalar* p = (scalar*)(to.data + first);
        __builtin_memcpy(p, &a, sizeof(a));
        __builtin_memcpy(p + WIDTH, &b, sizeof(b));
        __builtin_memcpy(p + 2 * WIDTH, &c, sizeof(c));
        return;
    }
    const Real held[] = {a, b, c};
    for (int k = 0; k < count; ++k) __builtin_memcpy((void*)&wp::index(to, first + k), (const scalar*)held + 3 * k, sizeof(Point));
}
static void store(const wp::array_t<Matrix>& to, int first, int count, const Real (&parts)[9])
{
    for (int k = 0; k < count; ++k) {
        scalar* out = (scalar*)&wp::index(to, first + k);
        for (int part = 0; part < 9; ++part) out[part] = parts[part][k];
    }
}
};
