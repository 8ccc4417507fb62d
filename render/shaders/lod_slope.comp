// The slope of the frame's morphs. One invocation.
layout(local_size_x = 1) in;

// full / threshold, rounded as a division: the quotient with the least remainder. Products of two floats are exact in double.
float quotient_of_threshold() {
    const float full = scalars.w, divisor = threshold();
    precise float guess = full * reciprocal(divisor);
    float best = guess;
    double least = 1e300lf;
    for (int step = -4; step <= 4; ++step) {
        const float quotient = intBitsToFloat(floatBitsToInt(guess) + step);
        precise double product = double(quotient) * double(divisor);
        precise double remainder = abs(double(full) - product);
        if (remainder < least) {
            least = remainder;
            best = quotient;
        }
    }
    return best;
}

void main() { state[kSlope] = floatBitsToUint(quotient_of_threshold()); }
