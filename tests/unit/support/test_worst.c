/* SPDX-License-Identifier: Apache-2.0 */
#include "worst.h"

#include "unity.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static double worst_of(const double *errors, int count)
{
    double worst = 0.0;
    for (int n = 0; n < count; n++) {
        worst = worse_of(worst, errors[n]);
    }
    return worst;
}

void test_the_largest_error_counts_wherever_it_occurs(void)
{
    TEST_ASSERT_EQUAL_DOUBLE(3.0, worst_of((const double[]){3.0, 1.0, 2.0}, 3));
    TEST_ASSERT_EQUAL_DOUBLE(3.0, worst_of((const double[]){1.0, 3.0, 2.0}, 3));
    TEST_ASSERT_EQUAL_DOUBLE(3.0, worst_of((const double[]){1.0, 2.0, 3.0}, 3));
}

void test_an_error_that_is_not_a_number_is_the_worst_wherever_it_occurs(void)
{
    TEST_ASSERT_TRUE(isnan(worst_of((const double[]){NAN, 1.0, 2.0}, 3)));
    TEST_ASSERT_TRUE(isnan(worst_of((const double[]){1.0, NAN, 2.0}, 3)));
    TEST_ASSERT_TRUE(isnan(worst_of((const double[]){1.0, 2.0, NAN}, 3)));
    TEST_ASSERT_TRUE(isnan(worst_of((const double[]){INFINITY, NAN, INFINITY}, 3)));
}
