//! The R factor against dense linear algebra.

use super::*;
use approx::assert_relative_eq;
use nalgebra::{DMatrix, DVector};
use rand::{RngExt, SeedableRng};

fn rows(n: usize, p: usize) -> Vec<Vec<f64>> {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
    (0..n)
        .map(|_| (0..=p).map(|_| rng.random_range(-1.0..1.0)).collect())
        .collect()
}

#[test]
fn agrees_with_a_dense_solution() {
    for n in [9, 32, 33, 200, 300] {
        let p = 5;
        let rows = rows(n, p);
        let mut triangle = Triangle::new(p + 1);
        for row in &rows {
            triangle.push(row);
        }
        triangle.finish();
        let j = DMatrix::from_fn(n, p, |i, k| rows[i][k]);
        let r = DVector::from_fn(n, |i, _| rows[i][p]);
        let dense = j.clone().svd(true, true).solve(&r, 1e-14).unwrap();
        let free: Vec<usize> = (0..p).collect();
        let x = triangle.solve(&free, &[1.0; 5], 0.0);
        for (a, b) in x.iter().zip(dense.iter()) {
            assert_relative_eq!(a, b, max_relative = 1e-10);
        }
        assert_relative_eq!(
            triangle.predicted(&x),
            (&j * &dense - &r).norm_squared(),
            max_relative = 1e-10
        );
        assert_relative_eq!(triangle.cost(), r.norm_squared(), max_relative = 1e-12);
        let inverse = (j.transpose() * &j).try_inverse().unwrap();
        let ours = triangle.covariance(&free).unwrap();
        for a in 0..p {
            for b in 0..p {
                assert_relative_eq!(
                    ours[a][b],
                    inverse[(a, b)],
                    max_relative = 1e-9,
                    epsilon = 1e-12
                );
            }
        }
        // Damped, with two parameters held.
        let damped = triangle.solve(&[0, 2, 4], &[1.0, 1.0, 2.0, 1.0, 0.5], 0.7);
        let sub = DMatrix::from_fn(n, 3, |i, k| rows[i][[0, 2, 4][k]]);
        let weight = DMatrix::from_diagonal(&DVector::from_vec(vec![0.7, 2.8, 0.175]));
        let reference = (sub.transpose() * &sub + weight)
            .lu()
            .solve(&(sub.transpose() * &r))
            .unwrap();
        for (k, i) in [0, 2, 4].into_iter().enumerate() {
            assert_relative_eq!(damped[i], reference[k], max_relative = 1e-10);
        }
    }
}

#[test]
fn a_step_of_two_outputs_is_that_of_the_likelihood() {
    // The columns explain most of one output, the other output is noise.
    let (n, p) = (120, 3);
    let rows = rows(2 * n, p);
    let mut triangles = vec![Triangle::new(p + 1), Triangle::new(p + 1)];
    let mut squares = Squares::new(&[n, n], |_| 0.0);
    for (k, row) in rows.iter().enumerate() {
        let mut row = row.clone();
        if k % 2 == 0 {
            row[p] = 3.0 * row[0] - row[1] + 0.1 * row[p];
        }
        triangles[k % 2].push(&row);
        squares.sums[k % 2] += row[p] * row[p];
    }
    for triangle in &mut triangles {
        triangle.finish();
    }
    let all = Triangle::of_outputs(triangles, &[], squares.clone());
    assert_relative_eq!(all.cost(), squares.cost(), max_relative = 1e-12);
    assert_relative_eq!(
        all.predicted(&[0.0; 3]),
        squares.cost(),
        max_relative = 1e-12
    );
    let x = all.solve(&[0, 1, 2], &[], 0.0);
    let best = all.predicted(&x);
    assert!(best < all.cost());
    for i in 0..p {
        for by in [-0.03, 0.03] {
            let mut moved = x.clone();
            moved[i] += by;
            assert!(all.predicted(&moved) > best);
        }
    }
}

#[test]
fn rows_given_by_columns_are_the_same_rows() {
    let p = 3;
    for n in [1, 127, 128, 129, 400] {
        let rows = rows(n, p);
        let mut by_rows = Triangle::new(p + 1);
        rows.iter().for_each(|row| by_rows.push(row));
        by_rows.finish();
        let columns: Vec<Vec<f64>> = (0..=p)
            .map(|j| rows.iter().map(|row| row[j]).collect())
            .collect();
        let mut by_columns = Triangle::new(p + 1);
        let (first, second): (Vec<_>, Vec<_>) =
            columns.iter().map(|column| column.split_at(n / 3)).unzip();
        by_columns.push_columns(&first);
        by_columns.push_columns(&second);
        by_columns.finish();
        assert_eq!((by_columns.rows(), &by_columns.r), (n, &by_rows.r));
    }
}

#[test]
fn lengths_determinant_and_damping_by_hand() {
    let mut triangle = Triangle::new(3);
    triangle.push_columns(&[&[1.0, 2.0, 2.0], &[1e6, 0.0, 1e6], &[3.0, 0.0, 3.0]]);
    triangle.finish();
    assert!(triangle.determined() && triangle.is_finite());
    assert_relative_eq!(
        triangle.squared_length(&[1.0, 1e-6]),
        17.0,
        max_relative = 1e-14
    );
    // |J'J| = 9 2e12 - (3e6)^2.
    assert_relative_eq!(triangle.log_det(), 9e12_f64.ln(), max_relative = 1e-14);
    let damped = triangle.damped(&[2.0, 1e6], 0.5);
    // |J'J| = 11 2.5e12 - (3e6)^2.
    assert_relative_eq!(damped.log_det(), 18.5e12_f64.ln(), max_relative = 1e-14);
    let at_once = triangle.solve(&[0, 1], &[2.0, 1e6], 0.5);
    for (own, at_once) in damped.solve(&[0, 1], &[], 0.0).iter().zip(at_once) {
        assert_relative_eq!(*own, at_once, max_relative = 1e-12);
    }
    triangle.push(&[f64::INFINITY, 0.0, 0.0]);
    triangle.finish();
    assert!(!triangle.is_finite());
}

#[test]
fn appended_rows_take_their_places() {
    let rows = rows(40, 2);
    let (mut all, mut expected) = (Triangle::new(4), Triangle::new(4));
    for (part, places) in rows.chunks(20).zip([[0, 1, 3], [0, 2, 3]]) {
        let mut own = Triangle::new(3);
        for row in part {
            own.push(row);
            let mut whole = [0.0; 4];
            places
                .iter()
                .zip(row)
                .for_each(|(&place, value)| whole[place] = *value);
            expected.push(&whole);
        }
        own.finish();
        all.append(&own, &places);
    }
    all.finish();
    expected.finish();
    assert_eq!(all.rows(), 40);
    for i in 0..4 {
        for j in i..4 {
            assert_relative_eq!(all.at(i, j).abs(), expected.at(i, j).abs(), epsilon = 1e-13);
        }
    }
}

#[test]
fn a_combination_of_columns_has_no_covariance() {
    let mut triangle = Triangle::new(4);
    for row in rows(50, 1) {
        triangle.push(&[row[0], row[1], row[0] + row[1], 1.0]);
    }
    triangle.finish();
    assert!(triangle.covariance(&[0, 1, 2]).is_none() && !triangle.determined());
    assert!(triangle.covariance(&[0, 1]).is_some());
}

/// A column that is a combination of two others: the three have no variance, and the fourth has that of all rows without the combination.
#[test]
fn a_combination_of_columns_leaves_the_others_determined() {
    let rows = rows(200, 4);
    let combined = |row: &Vec<f64>| {
        let mut row = row.clone();
        row[3] = 0.5 * row[0] - 40.0 * row[2];
        row
    };
    let of = |rows: &[Vec<f64>]| {
        let mut triangle = Triangle::new(rows[0].len());
        rows.iter().for_each(|row| triangle.push(row));
        triangle.finish();
        triangle
    };
    let all = of(&rows);
    assert_eq!(
        all.independent_among(&[3, 0, 1, 2]),
        (vec![3, 0, 1, 2], vec![])
    );
    let dependent = of(&rows.iter().map(combined).collect::<Vec<_>>());
    assert!(!dependent.determined());
    assert!(dependent.covariance(&[0, 1, 2, 3]).is_none());
    for order in [[0, 1, 2, 3], [3, 1, 0, 2], [2, 3, 1, 0]] {
        let (independent, groups) = dependent.independent_among(&order);
        assert_eq!(groups, [vec![0, 2, 3]]);
        assert_eq!(independent.len(), 3);
        let at = independent.iter().position(|&column| column == 1).unwrap();
        assert_relative_eq!(
            dependent.covariance(&independent).unwrap()[at][at],
            all.covariance(&[0, 1, 2]).unwrap()[1][1],
            max_relative = 1e-9
        );
    }
    assert_eq!(
        dependent.independent_among(&[0, 1, 3]),
        (vec![0, 1, 3], vec![])
    );
}

/// Two combinations without a common column are two groups; with one they are one.
#[test]
fn combinations_are_groups() {
    let groups = |combine: fn(&mut Vec<f64>)| {
        let mut triangle = Triangle::new(7);
        for mut row in rows(100, 6) {
            combine(&mut row);
            triangle.push(&row);
        }
        triangle.finish();
        let (independent, mut groups) = triangle.independent_among(&[0, 1, 2, 3, 4, 5]);
        groups.sort();
        (independent.len(), groups)
    };
    let apart = groups(|row| {
        row[1] = 3.0 * row[0];
        row[4] = row[2] - row[3];
    });
    assert_eq!(apart, (4, vec![vec![0, 1], vec![2, 3, 4]]));
    let joined = groups(|row| {
        row[1] = 3.0 * row[0];
        row[4] = row[2] - row[0];
    });
    assert_eq!(joined, (4, vec![vec![0, 1, 2, 4]]));
}

#[test]
fn a_signature_is_the_part_of_a_column_that_the_others_do_not_compensate_for() {
    let (n, p, sigma) = (60, 3, 0.5);
    // Two of four columns are the same, and the last one is that of the residual.
    let rows = rows(n, p);
    let mut triangle = Triangle::new(p + 2);
    for row in &rows {
        triangle.push(&[row[0], row[0], row[1], row[2], row[3]]);
    }
    triangle.finish();
    let column = |k: usize| DVector::from_fn(n, |i, _| rows[i][k]);
    let others = DMatrix::from_columns(&[column(0), column(1)]);
    let fitted = others
        .clone()
        .svd(true, true)
        .solve(&column(2), 1e-14)
        .unwrap();
    let own = (column(2) - others * fitted).norm() / sigma;
    let signature = triangle.signature(3, &[0, 1, 2], sigma);
    assert_relative_eq!(signature.own, own, max_relative = 1e-10);
    assert_relative_eq!(
        signature.whole,
        column(2).norm() / sigma,
        max_relative = 1e-10
    );
    let share = own * sigma / column(2).norm();
    assert_relative_eq!(signature.visibility(), share, max_relative = 1e-10);
    // 3.858 standard errors.
    let error = (triangle.covariance(&[0, 2, 3]).unwrap()[2][2]).sqrt() * sigma;
    let smallest = signature.smallest_detectable(1e-6).unwrap();
    assert_relative_eq!(smallest, 3.858 * error, max_relative = 1e-10);
    let absorbed = triangle.signature(0, &[1, 2], sigma);
    assert_eq!(absorbed.smallest_detectable(1e-6), None);
    assert!(absorbed.visibility() < 1e-6);
}
